#include "engine/readers/patient_procedure.h"

#include <fmt/format.h>

#include <cmath>

namespace stylet::readers {

namespace key = files::key;
using files::Key;

namespace {

constexpr files::Range kWithinPatient{-5, 5};  // m

constexpr struct {
  Key name = key::text("name", "short");
  Key shows = key::text("shows", "what is in the image");
  Key position = key::vector("position", "m", kWithinPatient, "centre of the probe's face");
  Key orientation = key::numbers("orientation_xyzw", 4, "", {-1, 1}, "patient from probe [x, y, z, w], norm 1");
} kView;

constexpr struct {
  Key name = key::text("name", "glTF node it is");
  Key centre = key::vector("centre", "m", kWithinPatient, "of the target");
  Key radius = key::number("radius", "m", {0, 1}, "of the target");
} kProcedureTarget;

constexpr struct {
  Key organs = key::file("organs", "glTF file of the organs");
  Key entry = key::vector("entry", "m", kWithinPatient, "where the needle enters the skin");
  Key target = key::object("target", files::table_of<kProcedureTarget>, "what the needle is aimed at");
  Key needle_direction =
      key::vector("needle_direction", "", {-1, 1}, "unit, from entry to target").otherwise(0, 0, 1);
  Key views =
      key::objects("views", files::table_of<kView>, "probe poses on the skin that show something worth seeing")
          .count({1, -1});
} kProcedure;

/// A unit vector or quaternion, as far as the digits of a file go.
bool is_unit(double norm) {
  return std::abs(norm - 1) <= 1e-3;
}

ProcedureView read_view(files::JsonObject& object) {
  ProcedureView view;
  view.name = object.text(kView.name);
  view.shows = object.text(kView.shows);
  view.pose.position = object.vector3(kView.position);
  const std::vector<double> q = object.numbers(kView.orientation);
  const Eigen::Quaterniond orientation =
      q.size() == 4 ? Eigen::Quaterniond(q[3], q[0], q[1], q[2]) : Eigen::Quaterniond::Identity();
  if (is_unit(orientation.norm())) {
    view.pose.orientation = orientation.normalized();
  } else {
    object.problem(kView.orientation, fmt::format("has norm {:.4g}, not 1", orientation.norm()));
  }
  object.finish();
  return view;
}

}  // namespace

const files::FileFormat& procedure_format() {
  static const files::FileFormat format{
      .name = "procedure",
      .title = "What a generated patient offers to whoever writes a scenario: entry, target, views; patient frame",
      .table = files::table_of<kProcedure>,
      .id = "stylet-procedure"};
  return format;
}

Procedure read_procedure(files::JsonFile& file) {
  files::JsonObject root = file.root(procedure_format());
  Procedure procedure;
  procedure.organs = root.file(kProcedure.organs);
  procedure.entry = root.vector3(kProcedure.entry);
  if (auto target = root.object(kProcedure.target)) {
    procedure.target_name = target->text(kProcedureTarget.name);
    procedure.target = target->vector3(kProcedureTarget.centre);
    procedure.target_radius = target->number(kProcedureTarget.radius);
    target->finish();
  }
  const Eigen::Vector3d direction = root.vector3(kProcedure.needle_direction);
  if (is_unit(direction.norm())) {
    procedure.needle_direction = direction.normalized();
  } else {
    root.problem(kProcedure.needle_direction, fmt::format("has norm {:.4g}, not 1", direction.norm()));
  }
  for (files::JsonObject& view : root.objects(kProcedure.views)) procedure.views.push_back(read_view(view));
  root.finish();
  return procedure;
}

}  // namespace stylet::readers
