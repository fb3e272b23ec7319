#include "engine/session/session_report.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

namespace stylet::session {

namespace {

nlohmann::ordered_json quantiles_us(const haptic::LatencyQuantiles& q) {
  const auto us = [](double s) { return std::round(s * 1e7) / 10; };
  return {{"median_us", us(q.median_s)}, {"p90_us", us(q.p90_s)}, {"p99_us", us(q.p99_s)}, {"max_us", us(q.max_s)}};
}

nlohmann::ordered_json to_json(const LoopRun& loop) {
  return {{"steps", loop.steps},
          {"rate_hz", loop.rate_hz},
          {"missed_deadlines", loop.missed_deadlines},
          {"step_time", quantiles_us(loop.step_time)},
          {"wakeup_latency", quantiles_us(loop.wakeup)}};
}

nlohmann::ordered_json to_json(const physics::PassivitySummary& passivity) {
  const physics::WatchedWork& window = passivity.least_window;
  const physics::WatchedWork& cycle = passivity.least_cycle;
  nlohmann::ordered_json json{
      {"window_s", passivity.window_s},       {"least_work_in_a_window_j", window.work},
      {"least_window_from_s", window.from_s}, {"least_window_to_s", window.to_s},
      {"closed_cycles", passivity.cycles},    {"cycles_that_ended_elsewhere", passivity.open}};
  if (passivity.cycles > 0) {
    json["least_work_of_a_cycle_j"] = cycle.work;
    json["least_cycle_from_s"] = cycle.from_s;
    json["least_cycle_to_s"] = cycle.to_s;
    json["least_cycle_stroke_m"] = cycle.stroke;
    json["least_cycle_peak_force_n"] = cycle.peak_force;
  }
  return json;
}

nlohmann::ordered_json to_json(const PictureSummary& pictures) {
  nlohmann::ordered_json json{{"frames", pictures.frames},
                              {"frames_per_second", pictures.frames_per_second},
                              {"frame_time", quantiles_us(pictures.frame_time)},
                              {"needle_to_picture", quantiles_us(pictures.needle_age)},
                              {"mean_scale", pictures.mean_scale},
                              {"ultrasound_images", pictures.images},
                              {"ultrasound_images_per_second", pictures.images_per_second},
                              {"ultrasound_to_picture", quantiles_us(pictures.ultrasound_age)}};
  return json;
}

nlohmann::ordered_json to_json(const haptic::GuardCounters& guard) {
  nlohmann::ordered_json json{{"samples", guard.samples}};
  for (int bit = 0; bit < haptic::kOutputFlagCount; ++bit) {
    json[haptic::output_flag_name(bit)] = guard.flagged[bit];
  }
  return json;
}

}  // namespace

std::string force_scale_text(double scale) {
  return scale < 1 ? fmt::format("{:.0f} % of the needle's force", 100 * scale) : "the needle's force as it is";
}

std::string hash_text(std::uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

nlohmann::ordered_json to_json(const SessionReport& report) {
  const RunStatistics& run = report.run;
  nlohmann::ordered_json json{
      {"format", "stylet-session"},
      {"version", 1},
      {"build", report.build},
      {"scenario", report.scenario},
      {"mode", run.mode},
      {"coupling", report.coupling},
      {"stylus", report.device},
      {"duration_s", run.duration_s},
      {"haptic_loop", to_json(run.haptic)},
      {"simulation_loop", to_json(run.simulation)},
      {"factorisations", run.factorisations},
      {"flags", {{"needle", run.needle_flags}, {"simulation", run.simulation_flags}, {"patch", run.patch_flags}}},
      {"unresolved",
       {{"haptic_steps_beyond_patch", run.unresolved.steps_beyond_patch},
        {"surfaces_felt_late_or_not", run.unresolved.surfaces_late}}},
      {"output_guard", to_json(run.guard)},
      {"peak_force_n", report.force.peak_force},
      {"peak_axial_force_n", report.force.peak_axial},
      {"peak_lateral_force_n", report.force.peak_lateral},
      {"max_depth_m", report.force.max_depth},
      {"least_work_j", report.force.least_work},
      {"passivity", to_json(report.passivity)},
      {"state_hash", hash_text(report.state_hash)},
      {"blas", report.blas},
      {"gpu", report.gpu},
      {"gpu_driver", report.gpu_driver}};
  if (report.start_seed) json["start_seed"] = *report.start_seed;
  if (report.force_output) {
    const ForceOutput& output = *report.force_output;
    json["force_output"] = {{"scale", output.scale},
                            {"device_max_force_n", output.max_force},
                            {"clipped_s", output.clipped_s},
                            {"clipped_times", output.clipped_times}};
  }
  json["punctures"] = nlohmann::ordered_json::array();
  for (const PunctureEvent& p : report.punctures) {
    json["punctures"].push_back({{"time_s", p.time_s}, {"from", p.from}, {"to", p.to}, {"force_n", p.force_n}});
    if (p.energy_j) json["punctures"].back()["energy_j"] = *p.energy_j;
  }
  json["needle_bent_deg"] = report.needle_bent_deg;
  if (std::isfinite(report.closest_target_distance)) {
    json["closest_target_distance_m"] = report.closest_target_distance;
  }
  if (report.probe) {
    const ProbeSummary& probe = *report.probe;
    json["probe"] = {{"mean_force_n", probe.mean_force},
                     {"peak_force_n", probe.peak_force},
                     {"mean_area_m2", probe.mean_area},
                     {"least_area_m2", probe.least_area}};
  }
  if (report.pictures) json["pictures"] = to_json(*report.pictures);
  for (const SavedImageFacts& image : report.saved_images) {
    nlohmann::ordered_json& entry = json["saved_images"].emplace_back();
    entry = {{"file", image.file},
             {"time_s", image.time_s},
             {"depth_m", image.depth},
             {"m_per_pixel", image.metres_per_pixel},
             {"distances_m", image.distances}};
  }
  if (report.replay_identical) {
    json["replay"] = {{"identical", *report.replay_identical}, {"hashes_compared", report.replay_hashes}};
  }
  if (!run.warning.empty()) json["real_time_warning"] = run.warning;
  return json;
}

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
  std::ofstream file(path);
  file << json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  file.close();
  if (!file) {
    throw files::ContentError(
        fmt::format("{}: cannot be written; free space or choose another --out", path.string()));
  }
}

std::string main_figures(const SessionReport& report) {
  const RunStatistics& run = report.run;
  const auto loop = [](const char* name, const LoopRun& l) {
    return fmt::format(
        "  {:<16} {:>6} steps at {:.0f} Hz, {} missed; step median {:.0f} us, p99 {:.0f} us, max {:.0f} us\n", name,
        l.steps, l.rate_hz, l.missed_deadlines, l.step_time.median_s * 1e6, l.step_time.p99_s * 1e6,
        l.step_time.max_s * 1e6);
  };
  std::string text = fmt::format("  {:<16} {:.1f} s, {}, {}, {}\n", "session", run.duration_s, run.mode,
                                 report.coupling, report.device);
  if (report.start_seed) text += fmt::format("  {:<16} drawn from --seed {}\n", "start", *report.start_seed);
  text += loop("haptic loop", run.haptic);
  text += loop("simulation loop", run.simulation);
  text += fmt::format("  {:<16} {}\n", "factorisations", run.factorisations);
  text += fmt::format("  {:<16} peak {:.2f} N (axial {:.2f}, lateral {:.2f}); deepest {:.0f} mm\n", "force",
                      report.force.peak_force, report.force.peak_axial, report.force.peak_lateral,
                      report.force.max_depth * 1e3);
  if (report.force_output) {
    const ForceOutput& output = *report.force_output;
    text += fmt::format(
        "  {:<16} {}; the device gives {:.1f} N{}\n", "force felt", force_scale_text(output.scale), output.max_force,
        output.clipped_times == 0
            ? ", never clipped"
            : fmt::format(", CLIPPED {} times, {:.1f} s in all", output.clipped_times, output.clipped_s));
  }
  if (report.passivity.cycles > 0) {
    const physics::WatchedWork& cycle = report.passivity.least_cycle;
    text +=
        fmt::format("  {:<16} least of {} cycles {:.3f} mJ ({:.1f} % of {:.2f} N x {:.1f} mm), {:.2f} to {:.2f} s\n",
                    "work of the hand", report.passivity.cycles, 1e3 * cycle.work, 100 * cycle.share(),
                    cycle.peak_force, 1e3 * cycle.stroke, cycle.from_s, cycle.to_s);
  }
  for (std::size_t i = 0; i < report.punctures.size(); ++i) {
    const PunctureEvent& p = report.punctures[i];
    text += fmt::format("  {:<16} {} to {} at {:.2f} s, {:.2f} N\n", i == 0 ? "punctures" : "", p.from, p.to,
                        p.time_s, p.force_n);
  }
  if (report.needle_bent_deg > 0) {
    text += fmt::format("  {:<16} bent by {:.0f} degrees\n", "needle", report.needle_bent_deg);
  }
  if (std::isfinite(report.closest_target_distance)) {
    text += fmt::format("  {:<16} {:.1f} mm from its centre at the closest\n", "target",
                        report.closest_target_distance * 1e3);
  }
  if (report.probe) {
    const ProbeSummary& probe = *report.probe;
    text += fmt::format("  {:<16} pressed with {:.1f} N on {:.1f} cm2 of skin (at most {:.1f} N, least {:.1f} cm2)\n",
                        "probe", probe.mean_force, probe.mean_area * 1e4, probe.peak_force, probe.least_area * 1e4);
  }
  if (report.pictures) {
    const PictureSummary& pictures = *report.pictures;
    text += fmt::format(
        "  {:<16} {:.1f} frames a second, needle {:.0f} ms old (p99 {:.0f}); ultrasound {:.1f} images a second, "
        "{:.0f} ms "
        "old\n",
        "pictures", pictures.frames_per_second, pictures.needle_age.median_s * 1e3, pictures.needle_age.p99_s * 1e3,
        pictures.images_per_second, pictures.ultrasound_age.median_s * 1e3);
  }
  for (std::size_t i = 0; i < report.saved_images.size(); ++i) {
    const SavedImageFacts& image = report.saved_images[i];
    text += fmt::format("  {:<16} {} of {:.1f} s", i == 0 ? "saved images" : "", image.file, image.time_s);
    for (const double distance : image.distances) text += fmt::format(", {:.1f} mm", distance * 1e3);
    text += '\n';
  }
  text += fmt::format("  {:<16} {}", "state hash", hash_text(report.state_hash));
  if (report.replay_identical) {
    text += *report.replay_identical ? fmt::format(", replayed bit for bit ({} hashes)", report.replay_hashes)
                                     : ", THE REPLAY DIFFERS";
  }
  text += '\n';
  if (!report.gpu.empty()) text += fmt::format("  {:<16} {} ({})\n", "pictures by", report.gpu, report.gpu_driver);
  if (!run.warning.empty()) text += fmt::format("  {:<16} {}\n", "note", run.warning);
  return text;
}

}  // namespace stylet::session
