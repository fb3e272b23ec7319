#include "engine/app/deliver_statements.h"

#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "engine/lab/delivery/http_record_store.h"
#include "engine/lab/store/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <system_error>

namespace stylet::app {

namespace store = lab::store;
namespace delivery = lab::delivery;

Connected connect_record_store(store::Lab& lab, const StoreAddress& address) {
  if (address.endpoint.empty()) {
    for (const char* name : {store::kHomePage, store::kEndpoint, store::kKeyFile, store::kXapiVersion}) {
      lab.set(name, {});
    }
    return {};
  }
  const std::string& home_page = address.home_page;
  const bool web = home_page.starts_with("https://") || home_page.starts_with("http://");
  const bool odd =
      std::ranges::any_of(home_page, [](char c) { return c <= ' ' || c > '~' || c == '<' || c == '>' || c == '"'; });
  if (!web || odd || !home_page.ends_with('/')) {
    throw files::ContentError(fmt::format(
        "{}: is no home page; give an address of the lab's own that ends in /, such as https://lab.example/stylet/",
        files::printable(home_page)));
  }
  std::filesystem::path key;
  std::string secret;
  if (!address.key_file.empty()) {
    std::error_code error;
    key = std::filesystem::absolute(address.key_file, error);
    secret = delivery::read_key(key);
  }
  delivery::HttpRecordStore checked({.endpoint = address.endpoint, .key = secret});
  const delivery::OutboxState before = delivery::outbox_state(lab.database());
  const int waiting = before.waiting + before.held + before.rejected + before.conflicts;
  std::string other = lab.setting(store::kWaitsFor);
  if (other.empty()) other = lab.setting(store::kEndpoint);  // of records from before kWaitsFor
  const bool moves = waiting > 0 && other != address.endpoint;
  if (moves && address.waiting == Waiting::refuse) {
    throw files::ContentError(
        fmt::format("{} statements wait for {}; say whether {} is to have them: --waiting send, or --waiting drop",
                    waiting, other.empty() ? "another store" : other, address.endpoint));
  }
  Connected connected{.version = address.version};
  if (connected.version.empty()) {
    const delivery::Answer about = checked.about();
    connected.version = delivery::version_of(about);
    if (connected.version.empty()) {
      connected.version = delivery::HttpSettings{}.version;
      connected.not_asked = about.http == 0 ? files::one_line(about.body)
                                            : fmt::format("its /about answers {} and names none", about.http);
    }
  }
  if (moves && address.waiting == Waiting::drop) delivery::empty_outbox(lab.database());
  lab.set(store::kEndpoint, address.endpoint);
  lab.set(store::kKeyFile, key.string());
  lab.set(store::kXapiVersion, connected.version);
  lab.set(store::kWaitsFor, address.endpoint);
  lab.set(store::kHomePage, home_page);
  connected.tried_again = delivery::try_again(lab.database());
  return connected;
}

std::optional<Delivery> deliver_statements(store::Lab& lab, int failures) {
  const std::string endpoint = lab.setting(store::kEndpoint);
  if (endpoint.empty()) return std::nullopt;
  const std::string key_file = lab.setting(store::kKeyFile);
  const std::string version = lab.setting(store::kXapiVersion);
  delivery::HttpRecordStore record_store({.endpoint = endpoint,
                                          .key = key_file.empty() ? std::string() : delivery::read_key(key_file),
                                          .version = version.empty() ? delivery::HttpSettings{}.version : version});
  std::mt19937_64 engine(std::random_device{}());
  delivery::Outbox outbox(lab.database(), record_store,
                          {.clock = store::system_ms,
                           .random = [&engine] { return std::uniform_real_distribution<double>(0, 1)(engine); },
                           .failures = failures});
  Delivery result{.sent = outbox.send()};
  result.left = delivery::outbox_state(lab.database());
  return result;
}

std::string delivery_words(const Delivery& delivery) {
  const delivery::OutboxState& left = delivery.left;
  std::string words = fmt::format("{} statements delivered", delivery.sent.delivered);
  if (left.waiting > 0 && left.oldest_ms) {
    words += fmt::format("; {} wait, the oldest since {}: {}", left.waiting,
                         store::utc_text(*left.oldest_ms).substr(0, 16), files::one_line(delivery.sent.stopped_by));
  }
  if (left.held > 0) {
    words +=
        fmt::format("; {} are held back until those whom they are about agree (`stylet lab consent`)", left.held);
  }
  if (left.rejected + left.conflicts > 0) {
    words += fmt::format("; {} are refused by the store, {} it has otherwise: {}", left.rejected, left.conflicts,
                         files::one_line(left.said));
  }
  return words;
}

}  // namespace stylet::app
