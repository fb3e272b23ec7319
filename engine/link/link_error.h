// What the network did wrong, in one line.
#pragma once

#include <stdexcept>

namespace stylet::link {

/// At load time only: an address that cannot be had. What goes wrong later is counted and told in the LinkReport.
class LinkError final : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

}  // namespace stylet::link
