// Report descriptors: what is accepted holds together, and every report of it decodes to finite numbers.
#include "haptic/hid/force_output.h"
#include "haptic/hid/stylus_map.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <algorithm>
#include <random>
#include <vector>

namespace {

using namespace stylet;
using namespace stylet::haptic::hid;
using fuzz::claim;

void claim_sound(const ReportDescriptor& descriptor) {
  std::vector<std::uint32_t> ends(descriptor.reports.size(), 0);
  for (const Field& field : descriptor.fields) {
    const Report* report = descriptor.report(field.type, field.report_id);
    claim(report != nullptr, "a field is of a report");
    std::uint32_t& end = ends[report - descriptor.reports.data()];
    claim(field.bit_offset >= end, "fields do not overlap");
    end = field.bit_offset + field.bit_size * field.count;
    claim(end <= report->bits, "a field is within its report");
    claim(field.logical_min <= field.logical_max, "a range is a range");
    (void)descriptor.selected(field, field.logical_max);
    (void)descriptor.selector(field, field.usage);
  }
}

void claim_finite(const HidReading& reading) {
  claim(reading.position.allFinite() && reading.velocity.allFinite() && reading.angular_velocity.allFinite() &&
            reading.orientation.coeffs().allFinite(),
        "a reading is finite");
  claim(std::abs(reading.orientation.norm() - 1) < 1e-6, "an orientation is a rotation");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportDescriptor descriptor;
  try {
    descriptor = parse_report_descriptor({data, size});
  } catch (const DescriptorError& error) {
    claim(error.byte_offset() <= size, "the byte is in the descriptor");
    fuzz::claim_one_line(error.what());
    return 0;
  }
  claim_sound(descriptor);
  const StylusMap map(descriptor, {});
  ForceOutput output(descriptor, {});
  claim(map.usable() == map.reason().empty(), "what is not usable has a reason");
  std::minstd_rand random(static_cast<unsigned>(size));
  std::vector<std::uint8_t> bytes(kMaxReportBytes + 1);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 8);
  HidReading reading;
  for (std::size_t k = 0; k < std::min<std::size_t>(descriptor.reports.size(), 64); ++k) {
    const Report& report = descriptor.reports[k];
    if (report.id != 0) bytes[0] = report.id;
    map.decode(std::span(bytes).first(report.bytes()), reading);
    claim_finite(reading);
  }
  (void)output.start({.write = [](auto) { return true; },
                      .set_feature = [](auto) { return true; },
                      .get_feature = [](auto out) { return static_cast<int>(out.size()); }});
  for (int k = 0; k < std::min(output.report_count(), 8); ++k) {
    const std::size_t sent = output.encode(k, {1, -1e300, 2}, {0, 1, 0}, bytes);
    claim(sent <= output.max_report_bytes(), "a force fits its report");
  }
  return 0;
}
