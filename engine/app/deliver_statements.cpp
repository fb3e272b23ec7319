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

void connect_record_store(store::Lab& lab, const std::string& endpoint, const std::string& home_page,
                          const std::string& key_file) {
  if (endpoint.empty()) {
    lab.set(store::kHomePage, {});
    lab.set(store::kEndpoint, {});
    lab.set(store::kKeyFile, {});
    return;
  }
  const bool address = home_page.starts_with("https://") || home_page.starts_with("http://");
  const bool odd =
      std::ranges::any_of(home_page, [](char c) { return c <= ' ' || c > '~' || c == '<' || c == '>' || c == '"'; });
  if (!address || odd || !home_page.ends_with('/')) {
    throw files::ContentError(fmt::format(
        "{}: is no home page; give an address of the lab's own that ends in /, such as https://lab.example/stylet/",
        files::printable(home_page)));
  }
  std::filesystem::path key;
  if (!key_file.empty()) {
    std::error_code error;
    key = std::filesystem::absolute(key_file, error);
    delivery::read_key(key);
  }
  const delivery::HttpRecordStore checked({.endpoint = endpoint});
  lab.set(store::kEndpoint, endpoint);
  lab.set(store::kKeyFile, key.string());
  lab.set(store::kHomePage, home_page);
}

std::optional<Delivery> deliver_statements(store::Lab& lab, int failures) {
  const std::string endpoint = lab.setting(store::kEndpoint);
  if (endpoint.empty()) return std::nullopt;
  const std::string key_file = lab.setting(store::kKeyFile);
  delivery::HttpRecordStore record_store(
      {.endpoint = endpoint, .key = key_file.empty() ? std::string() : delivery::read_key(key_file)});
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
  if (left.rejected + left.conflicts > 0) {
    words += fmt::format("; {} are refused by the store, {} it has otherwise: {}", left.rejected, left.conflicts,
                         files::one_line(left.said));
  }
  return words;
}

}  // namespace stylet::app
