#include "engine/readers/tissue_watch.h"

#include "engine/content/tissue_table.h"
#include "engine/files/error.h"

#include <system_error>

namespace stylet::readers {
namespace {

/// When the file was written last; the beginning of time where there is none.
std::filesystem::file_time_type last_written(const std::filesystem::path& path) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(path, error);
  return error ? std::filesystem::file_time_type{} : time;
}

}  // namespace

TissueWatch::TissueWatch(const content::Scene& scene)
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
    files::JsonFile file(table_);
    const content::TissueTable table = content::read_tissues(file);
    file.throw_problems();
    problem_.clear();
    for (const content::Tissue& row : table.tissues) {
      // Rows that organ files add come after those of the table.
      if (const int tissue = content::find_tissue(tissues_, row.name); tissue >= 0) {
        tissues_[tissue].acoustics = row.acoustics;
      }
    }
  } catch (const files::ContentError& error) {
    problem_ = error.what();
  }
}

}  // namespace stylet::readers
