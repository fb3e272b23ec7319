// Whether this was compiled with a sanitizer, which makes mathematics of small matrices five to thirty times slower.
#pragma once

namespace stylet::support {

/// A long test keeps its claim there and makes it of less: a coarser mesh, fewer steps. What a sanitizer looks for
/// depends on neither.
#ifdef STYLET_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace stylet::support
