// How a session holds the needle: what the stylus's data sheet allows.
#pragma once

#include "haptic/device.h"
#include "physics/needle/needle.h"

namespace stylet::session {

/// Prescribed for a device without force. Else a spring-damper that carries the force to the hand: half of the
/// damping that the device can render (the other half is left to passivity control), and the stiffness of the data
/// sheet, or half of what stays stable if that is less. A device without torque feels no moment, so its rotation is
/// held fifty times stiffer than an 18G needle bends.
physics::NeedleBase needle_base(const haptic::DeviceLimits& limits, double haptic_hz);

/// Stiffness below which a light device on a sampled spring is stable, (b + B)/(T/2 + t_d) (Hulin, Preusche and
/// Hirzinger 2006).
/// @param damping  b + B, of the device and of the spring's damper, N s/m
/// @param period_s, delay_s  T and t_d
double stable_stiffness(double damping, double period_s, double delay_s);

}  // namespace stylet::session
