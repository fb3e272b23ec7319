#include "engine/app/render.h"

namespace stylet::app {

nlohmann::ordered_json scanner_json(const content::Probe& probe) {
  return {{"preset", probe.preset}, {"depth_mm", probe.depth * 1e3}, {"gain_db", probe.gain_db}};
}

nlohmann::ordered_json legend_json(const content::PictureLabels& labels) {
  nlohmann::ordered_json legend = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < labels.names.size(); ++i) {
    legend.push_back({{"index", i}, {"name", labels.names[i]}, {"colour", content::PictureLabels::colour(int(i))}});
  }
  return legend;
}

}  // namespace stylet::app
