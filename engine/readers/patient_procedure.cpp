#include "engine/readers/patient_procedure.h"

#include <fmt/format.h>

#include <cmath>

namespace stylet::readers {

namespace {

constexpr files::Range kWithinPatient{-5, 5};  // m

/// A unit vector or quaternion, as far as the digits of a file go.
bool is_unit(double norm) {
  return std::abs(norm - 1) <= 1e-3;
}

ProcedureView read_view(files::JsonObject& object) {
  ProcedureView view;
  view.name = object.text("name");
  view.shows = object.text("shows");
  view.pose.position = object.vector3("position", kWithinPatient);
  const std::vector<double> q = object.numbers("orientation_xyzw", 4, {-1, 1});
  const Eigen::Quaterniond orientation =
      q.size() == 4 ? Eigen::Quaterniond(q[3], q[0], q[1], q[2]) : Eigen::Quaterniond::Identity();
  if (is_unit(orientation.norm())) {
    view.pose.orientation = orientation.normalized();
  } else {
    object.problem("orientation_xyzw", fmt::format("has norm {:.4g}, not 1", orientation.norm()));
  }
  object.finish();
  return view;
}

}  // namespace

Procedure read_procedure(files::JsonFile& file) {
  files::JsonObject root = file.root("stylet-procedure", 1);
  Procedure procedure;
  procedure.organs = root.file("organs");
  procedure.entry = root.vector3("entry", kWithinPatient);
  if (auto target = root.object("target")) {
    procedure.target_name = target->text("name");
    procedure.target = target->vector3("centre", kWithinPatient);
    procedure.target_radius = target->number("radius", {0, 1});
    target->finish();
  }
  const Eigen::Vector3d direction = root.vector3("needle_direction", {-1, 1}, Eigen::Vector3d::UnitZ());
  if (is_unit(direction.norm())) {
    procedure.needle_direction = direction.normalized();
  } else {
    root.problem("needle_direction", fmt::format("has norm {:.4g}, not 1", direction.norm()));
  }
  for (files::JsonObject& view : root.objects("views")) procedure.views.push_back(read_view(view));
  root.finish();
  return procedure;
}

}  // namespace stylet::readers
