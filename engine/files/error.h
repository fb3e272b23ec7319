// What the world did wrong, as one line a user can act on.
#pragma once

#include <stdexcept>
#include <string>

namespace stylet::files {

/// Thrown at load time. what() is one line: "file:place: what is wrong; what to do". `main` prints it and exits
/// with 2. Place is a line and column, a JSON pointer, or a glTF object such as meshes/3/primitives/0.
class ContentError : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

}  // namespace stylet::files
