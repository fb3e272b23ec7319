// A record store at an address: HTTP by libcurl.
#pragma once

#include "engine/lab/delivery/record_store.h"

#include <filesystem>
#include <memory>
#include <string>

namespace stylet::lab::delivery {

struct HttpSettings {
  std::string endpoint{};         ///< "https://lrs.example/xapi"; plain http at this computer alone
  std::string key{};              ///< "name:secret" of HTTP's Basic; empty: none
  std::string version = "2.0.0";  ///< of xAPI, in the header: 1.0.3 or 2.0.0
  int timeout_s = 10;
};

/// "name:secret" of the first line. @throws files::ContentError  others than its owner may read it, it is no such
/// file
std::string read_key(const std::filesystem::path& file);

/// The newest version that an answer of about() names and that is known here; empty: it names none.
std::string version_of(const Answer& about);

/// Certificates are checked, redirects are not followed. One thread.
class HttpRecordStore final : public RecordStore {
public:
  /// @throws files::ContentError  the endpoint is no address that it may be
  explicit HttpRecordStore(HttpSettings settings);
  ~HttpRecordStore() override;

  Answer post(const std::string& statements) override;
  Answer get(const std::string& id) override;
  /// What it says of itself: {"version": ["1.0.3", "2.0.0"]}.
  Answer about();

private:
  Answer ask(const std::string& url, const std::string* body);

  struct Close {
    void operator()(void* curl) const;
  };
  HttpSettings settings_;
  std::unique_ptr<void, Close> curl_;
};

}  // namespace stylet::lab::delivery
