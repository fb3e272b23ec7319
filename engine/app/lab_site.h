// The pages of a lab as a web server gives them to its instructors.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/server/http_server.h"
#include "engine/lab/server/logins.h"
#include "engine/lab/store/lab.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace stylet::app {

struct LabSiteSettings {
  std::vector<std::string> hosts{};   ///< by which it is asked: other names lead here by a trick (DNS rebinding)
  std::vector<std::string> behind{};  ///< of these, those that a web server with a certificate before it has
  bool names = false;                 ///< beside the pseudonyms
  std::function<std::int64_t()> clock = lab::store::system_ms;
};

/// A table of pages, exact: no path leads to a file. Whoever is not logged in gets the page to log in. GET changes
/// nothing but the list of who looked; what changes something is a POST with the session's token, from a page of
/// ours. One thread.
class LabSite {
public:
  /// Keeps references.
  LabSite(lab::store::Lab& lab, const lab::course::Course& course, LabSiteSettings settings);

  lab::server::Response answer(const lab::server::Request& request);

private:
  bool encrypted(const lab::server::Request& request) const;
  lab::server::Response log_in(const lab::server::Request& request);
  lab::server::Response page(const lab::server::Request& request, const lab::server::Session& session);
  lab::server::Response act(const lab::server::Request& request, const lab::server::Session& session,
                            const std::string& cookie);
  lab::server::Response compare(const lab::server::Request& request, const lab::server::Session& session);

  lab::store::Lab& lab_;
  const lab::course::Course& course_;
  LabSiteSettings settings_;
  lab::server::Logins logins_;
};

}  // namespace stylet::app
