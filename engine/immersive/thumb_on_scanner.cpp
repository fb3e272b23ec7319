#include "engine/immersive/thumb_on_scanner.h"

namespace stylet::immersive {

std::vector<scanner::Command> ThumbOnScanner::commands(const headset::Hands& hands, double time_s) {
  std::vector<scanner::Command> all;
  if (hands.freeze_pressed) all.emplace_back(scanner::Freeze{});
  switch (thumb_.pushes(hands.probe().stick, time_s)) {
    case Push::none:
      break;
    case Push::up:
      all.emplace_back(scanner::SetGain{scanner::kGainStep, true});
      break;
    case Push::down:
      all.emplace_back(scanner::SetGain{-scanner::kGainStep, true});
      break;
    case Push::right:
      all.emplace_back(scanner::SetDepth{scanner::kDepthStep, true});
      break;
    case Push::left:
      all.emplace_back(scanner::SetDepth{-scanner::kDepthStep, true});
      break;
  }
  return all;
}

}  // namespace stylet::immersive
