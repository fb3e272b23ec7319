// `stylet devices`: what is plugged in, what each can do, and why one is not usable.
#include "engine/app/device_session.h"
#include "engine/app/list_devices.h"
#include "engine/files/error.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace stylet::tools {

namespace {

struct DevicesOptions {
  bool json = false;
  bool fields = false;
  std::string descriptor;
  std::string id;
  bool calibrate = false;
  double still_s = 1;
  std::string record;
  double seconds = 0;  // 0: until Ctrl-C
  bool feel = false;
  double each_s = 15;
  std::string device;
};

void run(const DevicesOptions& options) {
  Terminal terminal;
  if (options.calibrate) return app::calibrate_device(app::parse_device(options.device), options.still_s, terminal);
  if (!options.record.empty()) {
    return app::record_device(app::parse_device(options.device), options.seconds, options.record, terminal);
  }
  if (options.feel) return app::feel_device(app::parse_device(options.device), options.each_s, terminal);
  if (!options.device.empty()) {
    throw files::ContentError("devices " + options.device +
                              ": say what to do with it, --calibrate, --feel or --record FILE");
  }
  nlohmann::json list = nlohmann::json::array();
  if (options.descriptor.empty()) {
    list = app::list_devices();
  } else {
    list.push_back(app::describe_descriptor(options.descriptor, app::parse_hid_id(options.id, "--id " + options.id),
                                            options.fields));
  }
  if (options.json) {
    for (nlohmann::json& device : list) device.erase("text");
    fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  for (const nlohmann::json& device : list) fmt::print("{}", device["text"].get<std::string>());
  if (list.empty()) fmt::print("no HID device is connected (there is no /dev/hidraw*)\n");
  if (!options.descriptor.empty()) return;
  const std::string sound = app::sound_device();
  fmt::print("sound: {}\n", sound.empty() ? "no device; sessions are silent" : sound);
}

}  // namespace

void add_devices(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "devices",
      "List the HID devices and those of the Haply service: what each can do, or why it is not usable; and where "
      "sound goes");
  auto options = std::make_shared<DevicesOptions>();
  command->add_flag("--json", options->json, "As JSON");
  auto* file = command->add_option("--descriptor", options->descriptor,
                                   "Describe a report descriptor from a file instead: bytes, or hexadecimal digits");
  command->add_option("--id", options->id, "VID:PID of that descriptor, to find its profile")->needs(file);
  command->add_flag("--fields", options->fields, "List every field of that descriptor")->needs(file);
  auto* calibrate = command->add_flag(
      "--calibrate", options->calibrate,
      "Measure a device with you: its rest place and corners, its dead zones; kept for `stylet train --device hid`");
  command->add_option("--hold", options->still_s, "How many seconds you hold still at each place")
      ->check(CLI::Range(0.05, 10.0))
      ->needs(calibrate)
      ->capture_default_str();
  auto* record = command
                     ->add_option("--record", options->record,
                                  "Motion file to write: a device's raw reports and the hand's poses; `stylet train "
                                  "--device recorded:FILE` plays it")
                     ->excludes(calibrate);
  command->add_option("--seconds", options->seconds, "How long to record; default: until Ctrl-C")
      ->check(seconds_above_zero())
      ->needs(record);
  auto* feel =
      command
          ->add_flag("--feel", options->feel,
                     "Feel a device with force: a spring, a wall, friction, a skin; each with what should be felt")
          ->excludes(calibrate)
          ->excludes(record);
  command->add_option("--each", options->each_s, "How many seconds each of them lasts")
      ->check(CLI::Range(0.5, 600.0))
      ->needs(feel)
      ->capture_default_str();
  command->add_option(
      "DEVICE", options->device,
      "VID:PID, or a path as it is listed, of the device to calibrate, feel or record; default: whichever "
      "HID device can do most");
  command->footer(
      "To list them none is opened, so no permission is needed. A device says itself what its reports are (HID "
      "report\n"
      "descriptor); content/devices/ has profiles for what it does not say. haptic/README.md specifies the force\n"
      "stylus that Stylet is made for.\n\n"
      "  stylet devices --calibrate                   how the device lies on your desk, and how far you reach\n"
      "  stylet devices --record hand.json --seconds 10\n"
      "  stylet devices --feel                        what its force is like, without a patient");
  command->callback([options] { run(*options); });
}

}  // namespace stylet::tools
