// 3D Systems' devices (Touch, Touch X, and the Geomagic and Sensable ones before them), by the HD library of
// OpenHaptics.
#pragma once

#include "haptic/host/driver.h"

#include <memory>
#include <string>

namespace stylet::haptic::host {

std::unique_ptr<Driver> make_hd_driver(const std::string& library, HostClock clock);

}  // namespace stylet::haptic::host
