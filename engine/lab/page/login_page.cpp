#include "engine/files/html.h"
#include "engine/lab/page/page_parts.h"

#include <fmt/format.h>

#include <iterator>

namespace stylet::lab::page {

std::string login_page(const std::string& problem, const PageFacts& facts) {
  std::string html = page_begin("Log in");
  fmt::format_to(
      std::back_inserter(html),
      R"(<header><p class="brand">Stylet lab</p><h1>Log in</h1></header><main><section>{}<form class="do" )"
      R"(method="post" action="login"><label>Instructor <input name="name" autocomplete="username" )"
      R"(required></label><label>Password <input name="password" type="password" )"
      R"(autocomplete="current-password" required></label><button>Log in</button></form></section></main>)"
      "\n",
      problem.empty()
          ? std::string()
          : fmt::format(R"(<p class="standing alarm" role="alert">{}</p>)", files::html::escaped(problem)));
  return html + page_end(facts);
}

}  // namespace stylet::lab::page
