// Cost of one B-mode image of the tour phantom, whole and by pass.
//   build/release/bin/stylet_ultrasound_bench
// On Mesa's software rasteriser the CPU column is the honest one: all of its threads, however busy the machine is.
#include "engine/gpu/device.h"
#include "engine/ultrasound/imager.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/ultrasound/phantom.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace {

using namespace stylet;

/// Range 0: lines computed for each of the probe's 192; range 1: looks; range 2: cells of the tetrahedral grid.
void frame(benchmark::State& run) {
  gpu::Device device;
  content::Scene scene = test::tour_phantom();
  test::make_deformable(scene, static_cast<int>(run.range(2)));
  const state::FrameState state = test::tour_state(scene);
  ultrasound::Imager imager(
      device, scene, {.looks = static_cast<int>(run.range(1)), .line_oversampling = static_cast<int>(run.range(0))});
  imager.image(state);  // compiles the pipelines
  std::map<std::string, std::vector<double>> passes;
  for (auto _ : run) {
    imager.image(state);
    run.PauseTiming();
    for (const auto& span : imager.pass_times()) passes[span.name].push_back(1e3 * span.seconds);
    run.ResumeTiming();
  }
  for (auto& [name, ms] : passes) {
    std::nth_element(ms.begin(), ms.begin() + static_cast<std::ptrdiff_t>(ms.size() / 2), ms.end());
    run.counters[name + "_ms"] = ms[ms.size() / 2];
  }
  run.SetLabel(device.identity().name + ", " STYLET_FLAGS);
}
BENCHMARK(frame)
    ->ArgNames({"oversampling", "looks", "cells"})
    ->Args({1, 3, 8})
    ->Args({2, 1, 8})
    ->Args({2, 3, 8})
    ->Args({2, 3, 24})
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void reference(benchmark::State& run) {
  const content::Scene scene = test::tour_phantom();
  const state::FrameState state = test::tour_state(scene);
  ultrasound::ReferenceImager imager(scene);
  for (auto _ : run) benchmark::DoNotOptimize(imager.image(state).data());
}
BENCHMARK(reference)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
