#include "tools/bench/mechanics_parts.h"

namespace stylet::bench {

Report mechanics_bevel(const BenchOptions& /*options*/) {
  return {};
}

}  // namespace stylet::bench
