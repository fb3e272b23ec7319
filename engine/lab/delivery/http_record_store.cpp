#include "engine/lab/delivery/http_record_store.h"

#include "engine/files/error.h"
#include "engine/files/json_scan.h"

#include <curl/curl.h>

#include <sys/stat.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <fstream>
#include <mutex>
#include <utility>

namespace stylet::lab::delivery {

namespace {

constexpr std::size_t kMostAnswer = 4u << 20;  // bytes

std::size_t take(char* bytes, std::size_t size, std::size_t count, void* into) {
  auto& body = *static_cast<std::string*>(into);
  if (body.size() + size * count > kMostAnswer) return 0;  // which ends it
  body.append(bytes, size * count);
  return size * count;
}

bool is_here(const std::string& host) {
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

struct FreeUrl {
  void operator()(CURLU* url) const { curl_url_cleanup(url); }
};
struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

std::string part_of(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return {};
  std::string copy = text;
  curl_free(text);
  return copy;
}

}  // namespace

std::string read_key(const std::filesystem::path& file) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0 || !S_ISREG(about.st_mode)) {
    throw files::ContentError(file.string() + ": is no file; write \"name:secret\" of the record store into it");
  }
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw files::ContentError(
        fmt::format("{}: others may read the record store's key; `chmod 600 {}`", file.string(), file.string()));
  }
  std::ifstream stream(file);
  std::string key;
  std::getline(stream, key);
  if (key.find(':') == std::string::npos || key.size() > 1000) {
    throw files::ContentError(file.string() + ": its first line is no \"name:secret\" of a record store");
  }
  return key;
}

HttpRecordStore::HttpRecordStore(HttpSettings settings) : settings_(std::move(settings)) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  const std::unique_ptr<CURLU, FreeUrl> url(curl_url());
  const bool address = curl_url_set(url.get(), CURLUPART_URL, settings_.endpoint.c_str(), 0) == CURLUE_OK;
  const std::string scheme = address ? part_of(url.get(), CURLUPART_SCHEME) : "";
  const bool safe = scheme == "https" || (scheme == "http" && is_here(part_of(url.get(), CURLUPART_HOST)));
  if (!safe || !part_of(url.get(), CURLUPART_USER).empty() || !part_of(url.get(), CURLUPART_QUERY).empty()) {
    throw files::ContentError(
        fmt::format("{}: is no address of a record store; it begins with https:// (http:// at this computer alone), "
                    "the key is in "
                    "a file",
                    files::printable(settings_.endpoint)));
  }
  while (settings_.endpoint.ends_with('/')) settings_.endpoint.pop_back();
  curl_.reset(curl_easy_init());
  if (!curl_) throw files::ContentError("libcurl cannot be used: no memory");
}

HttpRecordStore::~HttpRecordStore() = default;

void HttpRecordStore::Close::operator()(void* curl) const {
  curl_easy_cleanup(curl);
}

Answer HttpRecordStore::ask(const std::string& url, const std::string* body) {
  CURL* curl = curl_.get();
  curl_easy_reset(curl);
  Answer answer;
  std::array<char, CURL_ERROR_SIZE> error{};
  std::unique_ptr<curl_slist, FreeList> headers(
      curl_slist_append(nullptr, ("X-Experience-API-Version: " + settings_.version).c_str()));
  for (const char* header : {"Content-Type: application/json", "Expect:"}) {
    headers.reset(curl_slist_append(headers.release(), header));
  }
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);  // the key goes nowhere else
  // Plain http is for this computer alone: no proxy of the surroundings is to see the key.
  if (url.starts_with("http://")) curl_easy_setopt(curl, CURLOPT_NOPROXY, "*");
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_TIMEOUT, static_cast<long>(settings_.timeout_s));
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, error.data());
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &answer.body);
  if (!settings_.key.empty()) {
    curl_easy_setopt(curl, CURLOPT_HTTPAUTH, CURLAUTH_BASIC);
    curl_easy_setopt(curl, CURLOPT_USERPWD, settings_.key.c_str());
  }
  if (body != nullptr) {
    curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body->size()));
    curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body->c_str());
  }
  const CURLcode result = curl_easy_perform(curl);
  if (result != CURLE_OK) {
    answer.body = error[0] != '\0' ? error.data() : curl_easy_strerror(result);
    return answer;
  }
  long http = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &http);
  answer.http = static_cast<int>(http);
  curl_off_t wait = 0;
  curl_easy_getinfo(curl, CURLINFO_RETRY_AFTER, &wait);
  constexpr curl_off_t kDay = 86'400;
  if (wait > 0) answer.retry_after_s = static_cast<int>(wait < kDay ? wait : kDay);
  return answer;
}

Answer HttpRecordStore::post(const std::string& statements) {
  return ask(settings_.endpoint + "/statements", &statements);
}

Answer HttpRecordStore::about() {
  return ask(settings_.endpoint + "/about", nullptr);
}

std::string version_of(const Answer& about) {
  if (about.http != 200) return {};
  const auto json = nlohmann::json::parse(about.body, nullptr, false);
  if (!json.is_object() || !json.contains("version") || !json["version"].is_array()) return {};
  std::string newest;
  for (const nlohmann::json& version : json["version"]) {
    if (!version.is_string()) continue;
    const std::string text = version;
    if (text.starts_with("2.0")) return "2.0.0";
    if (text.starts_with("1.0")) newest = "1.0.3";
  }
  return newest;
}

Answer HttpRecordStore::get(const std::string& id) {
  return ask(fmt::format("{}/statements?statementId={}", settings_.endpoint, id), nullptr);
}

}  // namespace stylet::lab::delivery
