#include "tools/bench/ultrasound_speed.h"

#include "engine/ultrasound/imager.h"
#include "engine/ultrasound/presets.h"
#include "tools/bench/samples.h"
#include "tools/reference/ultrasound_phantom.h"

#include <fmt/format.h>

#include <ctime>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

/// Of all threads of the process, us.
double processor_time_us() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
}

/// One way of imaging the phantom, with a needle in it.
struct Case {
  std::string name;
  content::Scene scene;
  state::FrameState state;
  std::unique_ptr<ultrasound::Imager> imager;
  Samples cpu, gpu, wall;
  std::vector<std::pair<std::string, Samples>> passes;

  Case(gpu::Device& device, std::string name_, int cells, int lines, int samples,
       const ultrasound::ImagerSettings& settings)
      : name(std::move(name_)), scene(reference::whole_phantom()) {
    scene.wires.clear();  // patients have none
    scene.probe.scan_lines = lines;
    scene.probe.samples = samples;
    reference::make_deformable(scene, cells);
    state = reference::at_rest(scene);
    reference::place_needle(state, {-0.09F, 0, 0.012F}, {-0.003F, 0, 0.064F});
    imager = std::make_unique<ultrasound::Imager>(device, scene, settings);
    imager->image(state);  // compiles the pipelines
  }

  void frame() {
    const double before = processor_time_us();
    wall.time([this] { imager->image(state); });
    cpu.add(processor_time_us() - before);
    double sum = 0;
    const std::vector<gpu::Timestamps::Span> spans = imager->pass_times();
    passes.resize(spans.size());
    for (std::size_t i = 0; i < spans.size(); ++i) {
      passes[i].first = spans[i].name;
      passes[i].second.add(1e6 * spans[i].seconds);
      sum += 1e6 * spans[i].seconds;
    }
    gpu.add(sum);
  }

  std::string size() const { return fmt::format("{} tetrahedra", scene.bodies[0].mesh.tets.size()); }
};

Measurement milliseconds(const std::string& name, const Samples& samples, const std::string& note) {
  return {name, 1e-3 * samples.median(), "ms", {}, {}, {}, note};
}

}  // namespace

Report ultrasound_speed(gpu::Device& device, int frames) {
  constexpr int kSmall = 15, kLarge = 26;  // 6 cells^3: 20,250 and 105,456 tetrahedra
  const ultrasound::ImagerSettings raw = ultrasound::preset_settings(ultrasound::Preset::raw);
  const ultrasound::ImagerSettings clinical = ultrasound::preset_settings(ultrasound::Preset::clinical);
  ultrasound::ImagerSettings fine = clinical;
  fine.line_oversampling = 1;
  fine.planes = 13;

  std::vector<std::unique_ptr<Case>> cases;
  const auto add = [&](const char* name, int cells, int lines, int samples, const auto& settings) {
    cases.push_back(std::make_unique<Case>(device, name, cells, lines, samples, settings));
  };
  add("speed.raw", kSmall, 192, 512, raw);
  add("speed.raw_large_mesh", kLarge, 192, 512, raw);
  add("speed.clinical", kSmall, 192, 512, clinical);
  add("speed.512x1024x13", kSmall, 512, 1024, fine);
  constexpr int kFineEvery = 5;  // the fine one takes as long as all others together, and has no bound
  for (int i = 0; i < frames; ++i) {
    for (const std::unique_ptr<Case>& each : cases) {
      if (each == cases.back() && i % kFineEvery != 0) continue;
      each->frame();
    }
  }

  Report report;
  const bool lavapipe = device.identity().is_lavapipe();
  const std::string on = fmt::format("on {}", device.identity().name);
  for (const std::unique_ptr<Case>& each : cases) {
    const std::string note =
        fmt::format("{} x {} x {}, {}, {}", each->scene.probe.scan_lines, each->scene.probe.samples,
                    each.get() == cases.back().get() ? fine.planes : raw.planes, each->size(), on);
    Measurement cpu = milliseconds(each->name + ".cpu", each->cpu, note);
    if (lavapipe && each == cases.front()) cpu = noted(at_most(cpu.name, cpu.value, cpu.unit, 40), note);
    report.add(cpu);
    report.add(milliseconds(each->name + ".gpu", each->gpu, "time stamps"));
    report.add({each->name + ".fps",
                1e6 / each->wall.median(),
                "1/s",
                136.28,
                {},
                {},
                "reference: raysim's published mean, static mesh, 500 x 500, RTX 6000 Ada; theirs, another machine"});
  }
  for (const auto& [pass, times] : cases.front()->passes) {
    report.add(milliseconds("speed.raw.pass." + pass, times, {}));
  }
  report.add(noted(at_most("speed.large_over_small_mesh", cases[1]->cpu.median() / cases[0]->cpu.median(), "1", 1.3),
                   fmt::format("processor time, {} over {}", cases[1]->size(), cases[0]->size())));
  return report;
}

}  // namespace stylet::bench
