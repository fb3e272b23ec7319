#include "engine/app/lab_site.h"

#include "engine/app/build_name.h"
#include "engine/app/lab_pages.h"
#include "engine/files/error.h"
#include "engine/files/html.h"
#include "engine/lab/page/page.h"
#include "engine/lab/store/identity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

namespace stylet::app {

using lab::server::Request;
using lab::server::Response;
using lab::server::Session;

namespace {

constexpr const char* kCookie = "stylet";

Response redirect(const std::string& to) {
  return {.status = 303, .headers = {{"Location", to}}};
}

Response not_found() {
  return {.status = 404,
          .body = "<!DOCTYPE html><title>Nothing here</title><p>There is no such page. <a href=\"/\">Stylet lab</a>"};
}

std::string value(const std::map<std::string, std::string>& of, const std::string& name) {
  const auto found = of.find(name);
  return found != of.end() ? found->second : std::string();
}

/// "/7Q4M2KX.html" is the page of 7Q4M2KX; empty: of nobody.
std::string pseudonym_of(const std::string& path) {
  constexpr std::size_t kLetters = 7;
  const std::string end = ".html";
  if (path.size() != 1 + kLetters + end.size() || !path.ends_with(end)) return {};
  std::string pseudonym = path.substr(1, kLetters);
  return lab::store::is_pseudonym(pseudonym) ? pseudonym : std::string();
}

}  // namespace

LabSite::LabSite(lab::store::Lab& lab, const lab::course::Course& course, LabSiteSettings settings)
    : lab_(lab),
      course_(course),
      settings_(std::move(settings)),
      logins_([this](const std::string& name) { return lab_.instructor(name); }, settings_.clock) {}

Response LabSite::answer(const Request& request) {
  Response response = [&]() -> Response {
    if (std::ranges::find(settings_.hosts, request.host) == settings_.hosts.end()) return {.status = 421};
    const bool post = request.method == "POST";
    if (!post && request.method != "GET") return {.status = 405, .headers = {{"Allow", "GET, POST"}}};
    // From a page of another site, whatever it knows.
    if (post && !request.origin.empty() && request.origin != "http://" + request.host && !encrypted(request)) {
      return {.status = 403};
    }
    if (request.path == "/login" && post) return log_in(request);
    const std::string cookie = value(request.cookies, kCookie);
    const Session* session = logins_.session(cookie);
    if (session == nullptr) {
      if (post) return {.status = 403};
      return {.status = request.path == "/login" ? 200 : 401,
              .body = lab::page::login_page({}, {.build = build_name(), .made_ms = settings_.clock()})};
    }
    return post ? act(request, *session, cookie) : page(request, *session);
  }();
  for (const auto& [name, value] :
       {std::pair{
            "Content-Security-Policy",
            "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; frame-ancestors 'none'; base-uri "
            "'none'"},
        std::pair{"X-Content-Type-Options", "nosniff"}, std::pair{"Referrer-Policy", "same-origin"},
        std::pair{"Cache-Control", "no-store"}, std::pair{"Cross-Origin-Opener-Policy", "same-origin"},
        std::pair{"Cross-Origin-Resource-Policy", "same-origin"}}) {
    response.headers.emplace_back(name, value);
  }
  return response;
}

/// From a page of ours that came through a web server with a certificate.
bool LabSite::encrypted(const Request& request) const {
  return request.origin == "https://" + request.host &&
         std::ranges::find(settings_.behind, request.host) != settings_.behind.end();
}

Response LabSite::log_in(const Request& request) {
  const lab::page::PageFacts facts{.build = build_name(), .made_ms = settings_.clock()};
  const lab::server::Logins::Try tried = logins_.log_in(value(request.form, "name"), value(request.form, "password"));
  if (tried.wait_ms > 0) {
    const std::int64_t seconds = (tried.wait_ms + 999) / 1000;
    return {.status = 429,
            .body = lab::page::login_page(fmt::format("Too many tries; again in {} s.", seconds), facts),
            .headers = {{"Retry-After", std::to_string(seconds)}}};
  }
  if (!tried.cookie) return {.status = 403, .body = lab::page::login_page("Name or password is wrong.", facts)};
  Response response = redirect("/");
  response.headers.emplace_back("Set-Cookie", fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/{}", kCookie,
                                                          *tried.cookie, encrypted(request) ? "; Secure" : ""));
  return response;
}

Response LabSite::page(const Request& request, const Session& session) {
  const lab::page::PageFacts facts{
      .build = build_name(),
      .made_ms = settings_.clock(),
      .actions = lab::page::PageActions{.instructor = session.instructor, .token = session.token}};
  if (request.path == "/login") return redirect("/");
  if (request.path == "/" || request.path == "/index.html") {
    lab_.note("show", course_.name, session.instructor);
    return {.body = lab::page::cohort_page(course_, cohort_views(lab_, course_, settings_.names, settings_.clock()),
                                           facts)};
  }
  if (request.path == "/compare") return compare(request, session);
  const std::string pseudonym = pseudonym_of(request.path);
  if (pseudonym.empty()) return not_found();
  const auto person = lab_.find(pseudonym);
  if (!person) return not_found();
  lab_.note("show", pseudonym, session.instructor);
  return {.body = lab::page::trainee_page(
              course_, lab_view(lab_, course_, *person, settings_.names, settings_.clock()), facts)};
}

Response LabSite::compare(const Request& request, const Session& session) {
  const std::string a = value(request.query, "a");
  const std::string b = value(request.query, "b");
  if (!lab::store::is_id(a) || !lab::store::is_id(b)) return not_found();
  const std::optional<std::string> pseudonym = lab_.taken_by(a);
  if (!pseudonym) return not_found();
  const auto person = lab_.find(*pseudonym);
  if (!person) return not_found();
  const lab::page::TraineeView view = lab_view(lab_, course_, *person, settings_.names, settings_.clock());
  const auto index = [&](const std::string& id) -> std::optional<std::size_t> {
    const auto at = std::ranges::find(view.attempts, id, &lab::store::AttemptRecord::id);
    if (at == view.attempts.end()) return std::nullopt;
    return static_cast<std::size_t>(at - view.attempts.begin());
  };
  const auto left = index(a);
  const auto right = index(b);
  if (!left || !right) return not_found();  // of two people
  lab_.note("show", person->pseudonym, session.instructor);
  return {.body = lab::page::compare_page(
              view, *left, *right,
              {.build = build_name(),
               .made_ms = settings_.clock(),
               .actions = lab::page::PageActions{.instructor = session.instructor, .token = session.token}})};
}

Response LabSite::act(const Request& request, const Session& session, const std::string& cookie) {
  if (!lab::server::same_secret(value(request.form, "token"), session.token)) return {.status = 403};
  if (request.path == "/logout") {
    logins_.log_out(cookie);
    Response response = redirect("/login");
    response.headers.emplace_back("Set-Cookie",
                                  fmt::format("{}=; HttpOnly; SameSite=Strict; Path=/; Max-Age=0", kCookie));
    return response;
  }
  if (request.path != "/note") return not_found();
  const std::string pseudonym = value(request.form, "trainee");
  const auto person = lab::store::is_pseudonym(pseudonym) ? lab_.find(pseudonym) : std::nullopt;
  if (!person) return not_found();
  try {
    lab_.add_note(person->id, session.instructor, value(request.form, "body"));
  } catch (const files::ContentError& error) {
    return {.status = 400, .body = "<!DOCTYPE html><title>Not kept</title><p>" + files::html::escaped(error.what())};
  }
  return redirect("/" + person->pseudonym + ".html");
}

}  // namespace stylet::app
