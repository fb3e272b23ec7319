#include "tools/make_patient/torso.h"

#include "tools/make_patient/sheet.h"

#include <array>
#include <cmath>
#include <vector>

namespace stylet::patient::torso {
namespace {

// Skin: ellipses around the vertical axis x = 0, z = kCentreZ, slightly narrower above and below.
constexpr double kHalfWidth = 170.0_mm;
constexpr double kHalfDepth = 118.0_mm;
constexpr double kCentreZ = -8.0_mm;
constexpr double kTaper = 1.2;  // 1/m^2: 1.2 % narrower 100 mm above and below the middle

constexpr double kRibSpacing = 30.0_mm;
constexpr double kRibSlope = 0.36;  // tan 20 degrees
constexpr double kRibHalfHeight = 6.2_mm;
constexpr double kRibHalfThickness = 3.3_mm;
constexpr double kRibDepth = 28.3_mm;

// Front ends of the ribs: angle of the costal margin.
constexpr std::array<double, 5> kRibFront{112, 121, 130, 141, 163};
constexpr double kRibBack = 212;

// The section of the abdominal wall that is modelled.
constexpr double kWallLeft = 76;
constexpr double kWallRight = 196;
constexpr double kWallBottom = -118.0_mm;
constexpr double kWallTop = 95.0_mm;

const Vector3 kDomeCentre = mm(-33, -28, -8);

double scale(double y) {
  return 1 - kTaper * y * y;
}

Vector3 skin(double angle, double y) {
  const double a = radians(angle);
  return {kHalfWidth * scale(y) * std::cos(a), y, kCentreZ + kHalfDepth * scale(y) * std::sin(a)};
}

// Height of the costal margin, interpolated between the front ends of the ribs.
double margin_height(double angle) {
  struct Knot {
    double angle;
    double y;
  };
  std::array<Knot, 7> knots{};
  knots[0] = {kWallLeft, 44.0_mm};
  for (int i = 0; i < 5; ++i) {
    const double z = skin(kRibFront[i], 0).z();
    knots[i + 1] = {kRibFront[i], rib_height(kFirstRib + i) - kRibSlope * (z - kCentreZ)};
  }
  knots[6] = {kWallRight, -84.0_mm};
  std::size_t k = 0;
  while (k + 2 < knots.size() && angle > knots[k + 1].angle) ++k;
  const double t = (angle - knots[k].angle) / (knots[k + 1].angle - knots[k].angle);
  return knots[k].y + t * (knots[k + 1].y - knots[k].y);
}

constexpr double kBelowMargin = 11.0_mm;  // intercostal muscle: the lowest rib lies in it with its whole height

double inner_depth(double angle, double y) {
  const double edge = margin_height(angle) - kBelowMargin;
  return kWallEnd + (kIntercostalEnd - kWallEnd) * smoothstep(edge - 12.0_mm, edge, y);
}

// Unit square -> the same with rounded corners and bowed sides.
Eigen::Vector2d rounded(double u, double v) {
  constexpr double kBow = 0.30;
  const double s = 2 * u - 1;
  const double t = 2 * v - 1;
  return {0.5 + 0.5 * s * std::sqrt(1 - kBow * t * t / 2), 0.5 + 0.5 * t * std::sqrt(1 - kBow * s * s / 2)};
}

}  // namespace

double rib_height(int rib) {
  return 55.0_mm - kRibSpacing * (rib - kFirstRib);
}

double intercostal_height(int upper_rib, double z) {
  return rib_height(upper_rib) - kRibSpacing / 2 - kRibSlope * (z - kCentreZ);
}

Vector3 intercostal_plane_normal() {
  return Vector3(0, 1, kRibSlope).normalized();
}

Vector3 normal(double angle, double y) {
  const double a = radians(angle);
  const double slope = 2 * kTaper * y * scale(y);  // of (x/a)^2 + (z/b)^2 = scale^2 along y, halved
  return Vector3(scale(y) * std::cos(a) / kHalfWidth, slope, scale(y) * std::sin(a) / kHalfDepth).normalized();
}

Vector3 point(double angle, double y, double depth) {
  return skin(angle, y) - depth * normal(angle, y);
}

Vector3 intercostal_skin_point(int upper_rib, double angle) {
  double y = 0;
  for (int i = 0; i < 20; ++i) y = intercostal_height(upper_rib, skin(angle, y).z());
  return skin(angle, y);
}

double inner_distance(const Vector3& x, double depth) {
  const double a = kHalfWidth - depth;
  const double b = kHalfDepth - depth;
  const double s = scale(x.y());
  const double px = x.x() / (a * s);
  const double pz = (x.z() - kCentreZ) / (b * s);
  const double k0 = std::hypot(px, pz);
  const double k1 = std::hypot(px / (a * s), pz / (b * s));
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -b;
}

mesh::TriangleMesh wall_layer(double depth_from, std::optional<double> depth_to) {
  return sheet(52, 46, [&](double u, double v, bool outer) {
    const Eigen::Vector2d uv = rounded(u, v);
    const double angle = kWallLeft + uv.x() * (kWallRight - kWallLeft);
    const double y = kWallBottom + uv.y() * (kWallTop - kWallBottom);
    return point(angle, y, outer ? depth_from : depth_to.value_or(inner_depth(angle, y)));
  });
}

mesh::TriangleMesh intercostal_muscle() {
  return sheet(60, 34, [&](double u, double v, bool outer) {
    const double angle = kWallLeft + u * (kWallRight - kWallLeft);
    const double bottom = margin_height(angle) - kBelowMargin;
    return point(angle, bottom + v * (kWallTop - bottom), outer ? kWallEnd : kIntercostalEnd);
  });
}

mesh::TriangleMesh rib(int number) {
  constexpr int kRings = 56;
  const double front = kRibFront[number - kFirstRib];
  const auto centre = [&](double angle) {
    double y = 0;
    for (int i = 0; i < 20; ++i) {
      y = rib_height(number) - kRibSlope * (point(angle, y, kRibDepth).z() - kCentreZ);
    }
    return point(angle, y, kRibDepth);
  };
  std::vector<Ring> rings;
  for (int i = 0; i <= kRings; ++i) {
    // Rings crowd at the ends, where the section closes as a half ellipse over the last 7 mm.
    const double t = 0.5 - 0.5 * std::cos(3.14159265358979323846 * i / kRings);
    const double angle = front + t * (kRibBack - front);
    const Vector3 here = centre(angle);
    const double to_front = (here - centre(front)).norm();
    const double to_back = (here - centre(kRibBack)).norm();
    const double cap = std::min({1.0, to_front / 7.0_mm, to_back / 7.0_mm});
    const double profile = std::max(0.12, std::sqrt(1 - (1 - cap) * (1 - cap)));
    const Vector3 along = (centre(angle + 0.5) - centre(angle - 0.5)).normalized();
    const Vector3 straight_out = normal(angle, here.y());
    const Vector3 outward = (straight_out - straight_out.dot(along) * along).normalized();
    // A real rib varies in breadth: a touch of it.
    const double breadth = profile * (1 + 0.06 * std::sin(radians(4 * angle) + number));
    rings.push_back({here, breadth * kRibHalfThickness * outward, breadth * kRibHalfHeight * along.cross(outward)});
  }
  return tube(rings, 20);
}

mesh::TriangleMesh costal_cartilage() {
  // Through the front ends of the ribs, and on to the sternum; Catmull-Rom between.
  std::vector<Vector3> knots;
  knots.push_back(point(kRibFront[3] + 5, margin_height(kRibFront[3]) - 4.0_mm, kRibDepth));
  for (int i = 3; i >= 0; --i)
    knots.push_back(point(kRibFront[i] + 1.5, margin_height(kRibFront[i]) - 0.5_mm, kRibDepth));
  knots.push_back(point(101, 30.0_mm, kRibDepth));
  knots.push_back(point(92, 50.0_mm, kRibDepth));
  std::vector<Ring> rings;
  constexpr int kSteps = 9;
  const auto at = [&](int i) { return knots[std::clamp(i, 0, static_cast<int>(knots.size()) - 1)]; };
  const auto curve = [&](double s) {
    const int k = std::min(static_cast<int>(s), static_cast<int>(knots.size()) - 2);
    const double t = s - k;
    const Vector3 m0 = (at(k + 1) - at(k - 1)) / 2;
    const Vector3 m1 = (at(k + 2) - at(k)) / 2;
    return Vector3((2 * t * t * t - 3 * t * t + 1) * at(k) + (t * t * t - 2 * t * t + t) * m0 +
                   (-2 * t * t * t + 3 * t * t) * at(k + 1) + (t * t * t - t * t) * m1);
  };
  const int count = kSteps * (static_cast<int>(knots.size()) - 1);
  for (int i = 0; i <= count; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    const double last = static_cast<double>(knots.size() - 1);
    const Vector3 along = (curve(std::min(s + 0.05, last)) - curve(std::max(s - 0.05, 0.0))).normalized();
    const Vector3 centre = curve(s);
    const double angle =
        std::atan2((centre.z() - kCentreZ) / kHalfDepth, centre.x() / kHalfWidth) * 180 / 3.14159265358979323846;
    const Vector3 outward = (normal(angle, centre.y()) - normal(angle, centre.y()).dot(along) * along).normalized();
    const double end = std::min({1.0, 0.35 + i / 4.0, 0.35 + (count - i) / 4.0});
    rings.push_back({centre, end * 3.2_mm * outward, end * 5.2_mm * along.cross(outward)});
  }
  return tube(rings, 16);
}

double subphrenic(const Vector3& x) {
  // Right hemidiaphragm: full at the sides, flatter on top than an ellipsoid; below the middle it draws in, as the
  // costal arch does.
  constexpr double kPower = 2.5;
  const Vector3 semi(102.0_mm, x.y() > kDomeCentre.y() ? 108.0_mm : 92.0_mm, 88.0_mm);
  const Vector3 p = (x - kDomeCentre).cwiseQuotient(semi);
  const double flat = p.x() * p.x() + p.z() * p.z();
  const double k = std::pow(std::pow(flat, kPower / 2) + std::pow(std::abs(p.y()), kPower), 1 / kPower);
  const double slope = std::max(1e-6, (x - kDomeCentre).cwiseQuotient(semi.cwiseProduct(semi)).norm());
  const double dome = (k - 1) * p.norm() / slope;
  // The heart lies on the left half and flattens it.
  const double cardiac = (x - mm(6, 65, 0)).dot(Vector3(0.56, 0.83, 0));
  return smooth_max(smooth_max(dome, inner_distance(x, 38.8_mm), 12.0_mm), cardiac, 28.0_mm);
}

mesh::TriangleMesh diaphragm() {
  const Vector3& centre = kDomeCentre;
  // Distance from the centre to the surface subphrenic = offset along a direction.
  const auto reach = [&](const Vector3& direction, double offset) {
    double low = 0;
    double high = 0.2;
    for (int i = 0; i < 50; ++i) {
      const double middle = (low + high) / 2;
      (subphrenic(centre + middle * direction) < offset ? low : high) = middle;
    }
    return low;
  };
  // Stereographic-like square patch around "up, slightly right": no pole, even cells.
  const Vector3 up = Vector3(-0.25, 1, 0.10).normalized();
  const Vector3 right = Vector3(-1, -0.25, 0).normalized();
  const Vector3 front = right.cross(up).normalized();
  const Vector3 side = up.cross(front).normalized();
  return sheet(54, 54, [&](double u, double v, bool outer) {
    // Square to disc (elliptical map), disc to a cap of 88 degrees.
    const double s = 2 * u - 1;
    const double t = 2 * v - 1;
    const double a = s * std::sqrt(1 - t * t / 2);
    const double b = t * std::sqrt(1 - s * s / 2);
    const double radius = std::min(1.0, std::hypot(a, b));
    const double theta = radians(88) * radius;
    const Vector3 across = radius > 0 ? Vector3((a * side + b * front) / radius) : Vector3::Zero();
    const Vector3 direction = std::cos(theta) * up + std::sin(theta) * across;
    return Vector3(centre + reach(direction, outer ? 4.8_mm : 1.3_mm) * direction);
  });
}

}  // namespace stylet::patient::torso
