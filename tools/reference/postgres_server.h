// A PostgreSQL server of a test's or a bench's own: in a temporary folder, on a socket that lies there too, of an
// unprivileged user, gone at the end.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace stylet::reference {

/// Folder of initdb and postgres: PATH, else the newest of /usr/lib/postgresql. Nothing: there is none, or root finds
/// no other user to run it.
std::optional<std::filesystem::path> postgres_programs();

class PostgresServer {
public:
  /// Makes a cluster and starts it. @throws std::runtime_error
  explicit PostgresServer(std::filesystem::path programs);
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  /// A connection string, of its superuser.
  std::string address(const std::string& database = "postgres") const;
  /// As a power cut: connections are lost, what was committed is not.
  void stop();
  void start();

private:
  int run(const std::string& command) const;

  std::filesystem::path programs_;
  std::filesystem::path folder_;
  bool runs_ = false;
};

}  // namespace stylet::reference
