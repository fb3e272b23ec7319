#pragma once

#include "engine/files/error.h"

#include <string>

namespace stylet::lab {

/// What it throws.
template <typename Act>
std::string refusal(const Act& act) {
  try {
    act();
  } catch (const files::ContentError& error) {
    return error.what();
  }
  return "nothing was refused";
}

}  // namespace stylet::lab
