#include "engine/content/tissue_watch.h"

#include "engine/content/error.h"
#include "engine/content/tissue_table.h"

#include <system_error>

namespace stylet::content {
namespace {

/// When the file was written last; the beginning of time where there is none.
std::filesystem::file_time_type last_written(const std::filesystem::path& path) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(path, error);
  return error ? std::filesystem::file_time_type{} : time;
}

}  // namespace

TissueWatch::TissueWatch(const Scene& scene)
    : table_(scene.tissue_table), tissues_(scene.tissues), written_(last_written(table_)) {}

bool TissueWatch::poll(Clock::time_point now) {
  if (table_.empty() || now < next_) return false;
  next_ = now + std::chrono::seconds(1);
  const auto written = last_written(table_);
  // An editor that replaces a file leaves a moment without one.
  if (written == written_ || written == std::filesystem::file_time_type{}) return false;
  written_ = written;
  read();
  return true;
}

void TissueWatch::read() {
  try {
    JsonFile file(table_);
    const TissueTable table = read_tissues(file);
    file.throw_problems();
    problem_.clear();
    for (const Tissue& row : table.tissues) {
      // Rows that organ files add come after those of the table.
      if (const int tissue = find_tissue(tissues_, row.name); tissue >= 0) {
        tissues_[static_cast<std::size_t>(tissue)].acoustics = row.acoustics;
      }
    }
  } catch (const ContentError& error) {
    problem_ = error.what();
  }
}

}  // namespace stylet::content
