#include "tools/bench/ultrasound.h"

#include "engine/picture/picture.h"
#include "engine/ultrasound/presets.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/bench/ultrasound_speed.h"

#include <fmt/format.h>

#include <cstdio>
#include <iterator>

namespace stylet::bench {

Report phantom_pictures(const QualityRun& run) {
  Report report;
  if (run.out.empty()) return report;
  for (const ultrasound::Preset preset : {ultrasound::Preset::raw, ultrasound::Preset::clinical}) {
    ultrasound::ImagerSettings settings = ultrasound::preset_settings(preset);
    settings.width = 960;
    settings.height = 720;
    PhantomScan phantom(run.device, reference::whole_phantom(), settings);
    phantom.envelope();
    const std::filesystem::path file = run.out / fmt::format("phantom_{}.png", ultrasound::preset_name(preset));
    picture::write_png(file, phantom.picture());
    report.figures.push_back({fmt::format("The phantom, preset {}", ultrasound::preset_name(preset)),
                              "Wires in a column and a row; anechoic and grey-scale targets at 70 mm; stepped "
                              "cylinders at 40 mm; a rib and a "
                              "fluid cylinder left; a zone of 0.7 dB/cm/MHz right below, 0.5 elsewhere.",
                              file});
  }
  return report;
}

Report bench_ultrasound(const BenchOptions& options) {
  gpu::Device device;
  const QualityRun run{.device = device, .seeds = options.quick ? 2 : 8, .out = options.out};
  std::fputs(fmt::format("bench ultrasound: on {}, {} seeds\n", device.identity().name, run.seeds).c_str(), stderr);

  struct Part {
    const char* name;
    Report (*measure)(const QualityRun&);
  };
  constexpr Part kParts[] = {{"the phantom", phantom_pictures},
                             {"speckle and attenuation", speckle_quality},
                             {"contrast, shadow, enhancement", contrast_quality},
                             {"wires", geometry_quality},
                             {"motion and strain", motion_quality},
                             {"elevation", elevation_quality},
                             {"needle, repeat", needle_quality}};
  Report report;
  int done = 0;
  for (const Part& part : kParts) {
    std::fputs(fmt::format("bench ultrasound: {}/{} {}\n", ++done, std::size(kParts) + 1, part.name).c_str(), stderr);
    report.append(part.measure(run));
  }
  std::fputs(fmt::format("bench ultrasound: {0}/{0} speed\n", std::size(kParts) + 1).c_str(), stderr);
  report.append(ultrasound_speed(device, options.quick ? 5 : 50));
  return report;
}

}  // namespace stylet::bench
