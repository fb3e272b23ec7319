// A database of a test's own on the server that tools/test.sh started.
#pragma once

#include "engine/lab/store/postgres.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <utility>

namespace stylet::support {

/// STYLET_TEST_POSTGRES, a connection string whose user may make databases. Nothing: this machine has no server.
inline std::optional<std::string> test_postgres() {
  const char* address = std::getenv("STYLET_TEST_POSTGRES");
  return address != nullptr && *address != '\0' ? std::optional<std::string>(address) : std::nullopt;
}

/// Empty at first; gone at the end.
class PostgresTestDatabase {
public:
  /// @param server  connection string with "/postgres?" for its database
  explicit PostgresTestDatabase(std::string server) : server_(std::move(server)) {
    static std::atomic<int> made{0};
    name_ = "stylet_test_" + std::to_string(::getpid()) + "_" + std::to_string(++made);
    // Of template0: nobody is connected to it, so tests beside each other may copy it.
    lab::store::PostgresDatabase(server_, "public").run("CREATE DATABASE " + name_ + " TEMPLATE template0");
  }
  ~PostgresTestDatabase() {
    try {
      lab::store::PostgresDatabase(server_, "public").run("DROP DATABASE IF EXISTS " + name_ + " WITH (FORCE)");
    } catch (const std::exception&) {  // it goes with the server
    }
  }
  PostgresTestDatabase(const PostgresTestDatabase&) = delete;
  PostgresTestDatabase& operator=(const PostgresTestDatabase&) = delete;

  std::string address() const {
    std::string address = server_;
    return address.replace(address.find("/postgres?"), 10, "/" + name_ + "?");
  }

private:
  std::string server_;
  std::string name_;
};

}  // namespace stylet::support
