#include "tools/bench/mechanics.h"

#include "tools/bench/mechanics_parts.h"
#include "tools/bench/parts.h"

namespace stylet::bench {

Report bench_mechanics(const BenchOptions& options) {
  return run_parts("mechanics",
                   {{"bevel", mechanics_bevel},
                    {"swept", mechanics_swept},
                    {"organs", mechanics_organs},
                    {"passivity", mechanics_passivity},
                    {"probe", mechanics_probe},
                    {"latency", mechanics_latency},
                    {"breath", mechanics_breath},
                    {"limits", mechanics_limits}},
                   options);
}

}  // namespace stylet::bench
