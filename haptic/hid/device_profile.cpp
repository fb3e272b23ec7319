#include "haptic/hid/device_profile.h"

#include "haptic/hid/usages.h"

#include <algorithm>

namespace stylet::haptic::hid {

const char* name_of(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::kUnusable:
      return "not usable";
    case DeviceKind::kStylus:
      return "stylus";
    case DeviceKind::kSpaceMouse:
      return "space mouse";
    case DeviceKind::kPen:
      return "pen";
    case DeviceKind::kJoystick:
      return "joystick";
  }
  return "";
}

int DeviceProfile::match(const DeviceIdentity& identity, DeviceKind described) const {
  int best = 0;
  for (const DeviceMatch& match : matches) {
    int met = 1;
    if (match.vendor_id) met = *match.vendor_id == identity.vendor_id ? met + 4 : -100;
    if (!match.product_ids.empty()) {
      met += std::ranges::find(match.product_ids, identity.product_id) != match.product_ids.end() ? 8 : -100;
    }
    if (!match.product.empty()) met += identity.product.find(match.product) != std::string::npos ? 2 : -100;
    // Vendor reports are there because the descriptor says nothing.
    if (match.kind && vendor_reports.empty()) met += *match.kind == described ? 1 : -100;
    best = std::max(best, met);
  }
  return best;
}

ReportDescriptor with_vendor_reports(ReportDescriptor descriptor, const DeviceProfile& profile) {
  for (const VendorReport& vendor : profile.vendor_reports) {
    const auto replaced = [&](const auto& one, std::uint8_t id) {
      return one.type == vendor.type && id == vendor.id;
    };
    std::erase_if(descriptor.fields, [&](const Field& field) { return replaced(field, field.report_id); });
    std::erase_if(descriptor.reports, [&](const Report& report) { return replaced(report, report.id); });
    descriptor.reports.push_back(
        {.type = vendor.type, .id = vendor.id, .bits = 8 * (vendor.bytes - (vendor.id != 0 ? 1 : 0))});
    const auto item = static_cast<std::uint32_t>(descriptor.items.size());
    descriptor.items.push_back({});
    for (Field field : vendor.fields) {
      const auto application = static_cast<std::int32_t>(descriptor.collections.size());
      descriptor.collections.push_back({.type = kApplicationCollection, .usage = field.application, .parent = -1});
      field.collection = application;
      if (vendor.type == ReportType::kOutput) {
        descriptor.collections.push_back(
            {.type = kLogicalCollection, .usage = usages::kDownloadForceSample, .parent = application});
        ++field.collection;
      }
      field.type = vendor.type;
      field.report_id = vendor.id;
      field.item = item;
      descriptor.fields.push_back(field);
    }
  }
  return descriptor;
}

}  // namespace stylet::haptic::hid
