#include "tools/bench/tissue.h"

#include "tools/bench/parts.h"
#include "tools/bench/tissue_parts.h"

namespace stylet::bench {

Report bench_tissue(const BenchOptions& options) {
  return run_parts("tissue",
                   {{"cantilever", tissue_cantilever},
                    {"elements", tissue_elements},
                    {"compliance", tissue_compliance},
                    {"sessions", tissue_sessions},
                    {"okamura", tissue_okamura},
                    {"capsule", tissue_capsule},
                    {"speed", tissue_speed},
                    {"fine", tissue_fine}},
                   options);
}

}  // namespace stylet::bench
