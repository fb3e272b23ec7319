// Force Dimension's devices and the Novint Falcon, by the DHD library.
#pragma once

#include "haptic/host/driver.h"

#include <memory>
#include <string>

namespace stylet::haptic::host {

std::unique_ptr<Driver> make_dhd_driver(const std::string& library);

}  // namespace stylet::haptic::host
