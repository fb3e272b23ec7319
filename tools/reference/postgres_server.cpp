#include "tools/reference/postgres_server.h"

#include <grp.h>
#include <pwd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace stylet::reference {

namespace fs = std::filesystem;

namespace {

/// Who runs it: initdb refuses root. Null: as we are.
const passwd* other_user() {
  if (::geteuid() != 0) return nullptr;
  const passwd* user = ::getpwnam("postgres");
  return user != nullptr ? user : ::getpwnam("nobody");
}

bool has_programs(const fs::path& folder) {
  return ::access((folder / "initdb").c_str(), X_OK) == 0 && ::access((folder / "pg_ctl").c_str(), X_OK) == 0;
}

}  // namespace

std::optional<fs::path> postgres_programs() {
  if (::geteuid() == 0 && other_user() == nullptr) return std::nullopt;
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (!folder.empty() && has_programs(folder)) return folder;
  }
  std::error_code error;
  std::optional<fs::path> newest;
  int version = 0;
  for (const auto& entry : fs::directory_iterator("/usr/lib/postgresql", error)) {
    const int of_entry = std::atoi(entry.path().filename().c_str());
    if (of_entry <= version || !has_programs(entry.path() / "bin")) continue;
    version = of_entry;
    newest = entry.path() / "bin";
  }
  return newest;
}

int PostgresServer::run(const std::string& command) const {
  const pid_t child = ::fork();
  if (child == 0) {
    if (const passwd* user = other_user()) {
      if (::setgroups(0, nullptr) != 0 || ::setgid(user->pw_gid) != 0 || ::setuid(user->pw_uid) != 0) ::_exit(127);
    }
    if (::chdir(folder_.c_str()) != 0) ::_exit(127);
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

PostgresServer::PostgresServer(fs::path programs) : programs_(std::move(programs)) {
  // A socket's path has 107 characters at most, so not in TMPDIR, which may be long.
  std::string folder = "/tmp/stylet-postgres-XXXXXX";
  if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error(folder + ": cannot be made");
  folder_ = folder;
  const passwd* user = other_user();
  if (user != nullptr && ::chown(folder_.c_str(), user->pw_uid, user->pw_gid) != 0) {
    throw std::runtime_error(folder + ": cannot be given to another user");
  }
  if (run("'" + programs_.string() +
          "/initdb' -D data -U stylet -A trust -E UTF8 --locale=C --locale-provider=icu --icu-locale=en-US --no-sync "
          "--no-instructions >initdb.log 2>&1") != 0) {
    std::error_code error;
    fs::remove_all(folder_, error);
    throw std::runtime_error("initdb failed");
  }
  start();
}

PostgresServer::~PostgresServer() {
  if (runs_) stop();
  std::error_code error;
  fs::remove_all(folder_, error);
}

std::string PostgresServer::address(const std::string& database) const {
  return "postgresql:///" + database + "?user=stylet&host=" + folder_.string();
}

void PostgresServer::start() {
  // Its files are of the moment: no waiting for the disk.
  if (run("'" + programs_.string() + "/pg_ctl' start -w -t 120 -s -D data -l server.log -o \"-k '" +
          folder_.string() + "' -c listen_addresses= -c fsync=off\" >start.log 2>&1") != 0) {
    throw std::runtime_error("PostgreSQL does not start in " + folder_.string());
  }
  runs_ = true;
}

void PostgresServer::stop() {
  run("'" + programs_.string() + "/pg_ctl' stop -w -t 120 -s -D data -m immediate >stop.log 2>&1");
  runs_ = false;
}

}  // namespace stylet::reference
