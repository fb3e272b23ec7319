#include "tools/make_patient/phantom.h"

#include "tools/make_patient/contour.h"
#include "tools/make_patient/implicit.h"

namespace stylet::patient {

std::vector<PhantomBall> phantom_balls() {
  return {{"target_1", "bright_target", mm(-4, 0, -22), 7.0_mm},
          {"target_2", "dark_target", mm(8, 0, -34), 6.0_mm},
          {"target_3", "bright_target", mm(-2, 0, -46), 5.0_mm}};
}

std::vector<Organ> make_phantom() {
  const Vector3 half = mm(65, 40, 35);
  const Vector3 middle = mm(0, 0, -35);
  const auto block = [&](const Vector3& x) {
    const Vector3 off = (x - middle).cwiseAbs() - half;
    return off.cwiseMax(0.0).norm() + std::min(off.maxCoeff(), 0.0);
  };
  const Vector3 margin = mm(8, 8, 8);
  std::vector<Organ> organs;
  organs.push_back({"phantom", "boundary", "agar", "phantom",
                    contour(block, {middle - half - margin, middle + half + margin}, 8.0_mm)});
  for (const PhantomBall& ball : phantom_balls()) {
    const Vector3 reach = Vector3::Constant(ball.radius + 3.0_mm);
    organs.push_back({ball.name, "target", ball.tissue, "phantom",
                      contour([&](const Vector3& x) { return sphere(x, ball.centre, ball.radius); },
                              {ball.centre - reach, ball.centre + reach}, 1.8_mm)});
  }
  return organs;
}

}  // namespace stylet::patient
