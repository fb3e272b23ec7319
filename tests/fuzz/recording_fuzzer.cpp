// Recordings from memory: what is read is what the records hold, or one line.
#include "engine/files/error.h"
#include "engine/recording/recording.h"
#include "engine/recording/recording_format.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <cstring>
#include <optional>
#include <random>
#include <string_view>
#include <vector>

namespace {

using namespace stylet;
namespace format = recording::format;

constexpr std::size_t kHeaderAt = format::kMagic.size() + 4;

struct Record {
  char type = 0;
  std::string payload;
};

/// A recording taken to pieces, without its checksums.
struct Pieces {
  std::string header;
  std::vector<Record> records;
};

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

void append_word(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

void append_checksum(std::string& bytes, std::size_t from) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data()) + from;
  append_word(bytes, files::crc32c({first, bytes.size() - from}));
}

std::optional<Pieces> take_apart(std::string_view bytes) {
  if (bytes.size() < kHeaderAt) return {};
  const std::size_t header_bytes = word(bytes, format::kMagic.size());
  std::size_t at = kHeaderAt + header_bytes + format::kChecksumBytes;
  if (at > bytes.size()) return {};
  Pieces pieces{.header = std::string(bytes.substr(kHeaderAt, header_bytes)), .records = {}};
  while (bytes.size() - at >= format::kFrontBytes + format::kChecksumBytes) {
    const std::size_t length = word(bytes, at + 1);
    if (length > bytes.size() - at - format::kFrontBytes - format::kChecksumBytes) break;
    pieces.records.push_back({bytes[at], std::string(bytes.substr(at + format::kFrontBytes, length))});
    at += format::kFrontBytes + length + format::kChecksumBytes;
  }
  return pieces;
}

/// The same as a file, its lengths and checksums right.
std::string put_together(const Pieces& pieces) {
  std::string out(format::kMagic.begin(), format::kMagic.end());
  append_word(out, pieces.header.size());
  out += pieces.header;
  append_checksum(out, 0);
  for (const Record& record : pieces.records) {
    const std::size_t from = out.size();
    out += record.type;
    append_word(out, record.payload.size());
    out += record.payload;
    append_checksum(out, from);
  }
  return out;
}

void change(Pieces& pieces, std::minstd_rand& random) {
  if (pieces.records.empty() || random() % 4 == 0) return fuzz::mutate(pieces.header, 32);
  const std::size_t at = random() % pieces.records.size();
  Record& record = pieces.records[at];
  switch (random() % 8) {
    case 0:
      record.type = static_cast<char>(random() % 7);
      break;
    case 1:
      pieces.records.erase(pieces.records.begin() + static_cast<std::ptrdiff_t>(at));
      break;
    case 2:
      pieces.records.push_back(Record(record));
      break;
    default:
      fuzz::mutate(record.payload, random() % 4 == 0 ? 32 : 0);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const recording::Recording recording = recording::parse_recording({data, size}, "fuzz.rec");
    fuzz::claim(recording.usable_bytes <= size && recording.file_bytes == size, "the bytes are counted");
    if (recording.complete()) {
      fuzz::claim(recording.end->haptic_steps == recording.haptic.size(),
                  "a complete recording has all haptic steps");
      fuzz::claim(recording.end->simulation_steps == recording.simulation.size(),
                  "a complete recording has all simulation steps");
    }
    for (const recording::EventRecord& event : recording.events) {
      fuzz::claim(event.name.size() <= recording::kMaxEventText && event.fields.size() <= 255, "events are limited");
      for (const recording::Field& field : event.fields) {
        fuzz::claim(field.name.size() <= recording::kMaxEventText, "texts of events are limited");
      }
    }
    fuzz::claim_one_line(recording.condition());
  } catch (const files::ContentError& error) {
    fuzz::claim_one_line(error.what());
  }
  return 0;
}

// Behind a checksum no random change is ever read: mostly a piece changes and the file is put together again.
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  std::minstd_rand random(seed);
  std::optional<Pieces> pieces = take_apart({reinterpret_cast<const char*>(data), size});
  if (!pieces || random() % 16 == 0) return LLVMFuzzerMutate(data, size, max_size);
  change(*pieces, random);
  const std::string out = put_together(*pieces);
  if (out.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, out.data(), out.size());
  return out.size();
}
