#include "engine/scanner/saved_image.h"

#include <fmt/format.h>

namespace stylet::scanner {

std::string saved_image_name(std::size_t number) {
  return fmt::format("ultrasound-{:02}.png", number);
}

}  // namespace stylet::scanner
