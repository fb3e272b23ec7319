#include "engine/import/scene_import.h"

#include "engine/content/probe_placement.h"
#include "engine/files/error.h"
#include "engine/files/pulse.h"
#include "engine/import/derived_body.h"
#include "engine/import/derived_wall.h"
#include "engine/import/scene_placement.h"
#include "engine/import/scene_survey.h"
#include "engine/import/site_search.h"
#include "engine/import/thin_out.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/surface_pieces.h"
#include "engine/mesh/tet_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

namespace stylet::import {
namespace {

using files::ContentError;
using gltf::AnnotatedSurface;
using mesh::Solid;
using mesh::TriangleMesh;

constexpr double kCutArea = 20e-6;      // m^2: from here on an organ counts as cut by the end of the scan
constexpr double kLargeOverlap = 0.2;   // of the smaller organ: segmentations do not overlap by so much
constexpr double kThinOut = 0.1e-3;     // m: far less than a scan's voxel
constexpr double kSplitCell = 0.002;    // m, of the surfaces of an organ that is parted
constexpr double kSmallestBall = 0.55;  // of the lesion that was asked for, where an organ has no room for it
constexpr const char* kDerivedBody = "body";
constexpr const char* kMadeUpTissue = "tumour";

/// An organ on its way: what the side file says and its surface.
struct Made {
  const SideOrgan* side;
  TriangleMesh surface;
  SceneOrgan account;
};

class SceneImport {
public:
  SceneImport(const std::vector<SourceFile>& files, const SideFile& side, const std::set<std::string>& tissues,
              const content::Probe& probe, const ImportProgress& progress)
      : files_(files),
        side_(side),
        scenario_(*side_.scenario),
        tissues_(tissues),
        probe_(probe),
        progress_(progress) {
    // The derived body is an organ like the others, before them.
    if (!scenario_.wall.skin.empty()) return;
    scenario_.wall.skin = kDerivedBody;
    while (
        std::ranges::any_of(side_.organs, [&](const SideOrgan& organ) { return organ.id == scenario_.wall.skin; })) {
      scenario_.wall.skin += "_derived";
    }
    side_.organs.insert(side_.organs.begin(), {.pointer = scenario_.wall.pointer, .id = scenario_.wall.skin});
    derives_body_ = true;
  }

  ImportedScene run() {
    make_organs();
    place_needle();
    add_wall();
    for (Made& organ : made_) add_organ(organ);
    add_contacts();
    progress_("looking for overlaps", 0);
    survey();
    return std::move(scene_);
  }

private:
  [[noreturn]] void fail(const std::string& pointer, const std::string& what) const {
    throw ContentError(fmt::format("{}:{}: {}", side_.path.string(), pointer, what));
  }

  const Made& made(const std::string& id) const {
    return *std::find_if(made_.begin(), made_.end(), [&](const Made& organ) { return organ.side->id == id; });
  }

  files::Pulse pulse(const std::string& task) const {
    return [this, task] { progress_(task, 0); };
  }

  std::string tissue_of(const SideOrgan& organ, const OrganParts& parts) const {
    std::string tissue = organ.tissue;
    for (const SourcePart* part : parts.parts) {
      if (tissue.empty() && part->tissue) tissue = part->tissue->preset;
    }
    if (tissue.empty()) tissue = organ.id;
    check_tissue(organ.pointer + "/tissue", tissue);
    return tissue;
  }

  void check_tissue(const std::string& pointer, const std::string& tissue) const {
    if (tissues_.contains(tissue)) return;
    const std::string close = files::nearest(tissue, tissues_);
    fail(pointer, fmt::format("the tissue table has no \"{}\"; {}", tissue,
                              close.empty() ? "name one of its rows" : "did you mean \"" + close + "\"?"));
  }

  void make_organs() {
    std::set<const SourcePart*> taken;
    for (const SideOrgan& organ : side_.organs) {
      if (organ.ball > 0) continue;  // when its body is there
      if (derives_body_ && organ.id == scenario_.wall.skin) {
        progress_("deriving the body", 0);
        DerivedBody body = derive_body(files_, [&] { progress_("deriving the body", 0); });
        made_.push_back({.side = &organ,
                         .surface = std::move(body.surface),
                         .account = {.id = organ.id, .role = "boundary", .notes = {body.how}}});
        scene_.warnings.push_back(
            fmt::format("the body is {}; look at it, or name its skin in {}/skin", body.how, scenario_.wall.pointer));
        continue;
      }
      std::vector<OrganParts> parts;
      try {
        parts = assign_parts(files_, {{.id = organ.id, .patterns = organ.parts, .of_several_files = true}},
                             pulse("reading " + organ.id));
      } catch (const ContentError& error) {
        fail(organ.pointer + "/parts", error.what());
      }
      for (const SourcePart* part : parts.front().parts) {
        if (!taken.insert(part).second && !lies_in_its_own_part(organ, part)) {
          fail(organ.pointer + "/parts",
               fmt::format("\"{}\" belongs to an earlier organ too; narrow one of the patterns", part->name));
        }
      }
      if (organ.role == "ignore") continue;
      Made made{.side = &organ, .surface = {}, .account = {}};
      made.account.id = organ.id;
      made.account.role = organ.role;
      made.account.body = organ.deformable ? organ.id : organ.body;
      made.account.tissue = organ.id == scenario_.wall.skin ? "" : tissue_of(organ, parts.front());
      for (const SourcePart* part : parts.front().parts) made.account.parts.push_back(part->name);
      parts_of_.emplace_back(organ.id, parts.front().parts);
      if (organ.role == "visual" && !parts.front().file->image) {
        TriangleMesh soup;
        for (const SourcePart* part : parts.front().parts) append(soup, part->mesh);
        made.surface =
            mesh::clean_surface(soup, parts.front().parts.front()->place, nullptr, pulse("reading " + organ.id));
      } else {
        ImportedOrgan imported = import_surface(parts.front(), {.solid = organ.deformable}, progress_);
        made.account.notes = imported.report.notes;
        made.surface = std::move(imported.surface);
        if (organ.deformable) keep_largest_piece(made);
      }
      made_.push_back(std::move(made));
    }
    for (const SourceFile& file : files_) {
      for (const SourcePart& part : file.parts) {
        if (!taken.contains(&part)) scene_.left_out.push_back(part.name);
      }
    }
    std::stable_sort(made_.begin(), made_.end(),
                     [](const Made& a, const Made& b) { return a.side->priority < b.side->priority; });
  }

  /// What deforms gets tetrahedra in one piece: specks of a segmentation beside it could not move with it.
  void keep_largest_piece(Made& organ) {
    std::optional<mesh::OuterPieces> split = mesh::outer_pieces(organ.surface, pulse("reading " + organ.account.id));
    if (!split || split->pieces.size() < 2) return;
    double whole = 0, most = 0;
    std::size_t largest = 0;
    for (std::size_t i = 0; i < split->pieces.size(); ++i) {
      const double volume = mesh::inspect(split->pieces[i]).volume;
      whole += volume;
      if (volume <= most) continue;
      most = volume;
      largest = i;
    }
    organ.surface = std::move(split->pieces[largest]);
    organ.account.notes.push_back(fmt::format("{} smaller piece(s) left out, {:.2g} % of its volume",
                                              split->pieces.size() - 1, 100 * (1 - most / whole)));
  }

  /// A lesion in a segmentation whose labels exclude each other is a part of the organ that it lies in, too.
  bool lies_in_its_own_part(const SideOrgan& organ, const SourcePart* part) const {
    return std::ranges::all_of(parts_of_, [&](const auto& other) {
      const auto& [id, parts] = other;
      return id == organ.body || std::ranges::find(parts, part) == parts.end();
    });
  }

  void place_needle() {
    progress_("placing needle and probe", 0);
    body_ = std::make_unique<Body>(made(scenario_.wall.skin).surface);
    scene_.cuts = body_->cuts();
    make_balls();
    scene_.target = centre_of(made(scenario_.target).surface);
    const bool proposed = !scenario_.entry || !scenario_.probe.at;
    if (proposed) propose_sites();
    place_on_skin(side_, *body_, scene_);
    if (proposed) look_at_needle();
  }

  /// What a needle and an image meet, seen from an organ that the target lies in.
  SiteSearch search_about(const std::string& carrier) const {
    std::vector<SiteOrgan> organs;
    for (const Made& organ : made_) {
      const SceneOrgan& account = organ.account;
      if (account.id == scenario_.wall.skin || account.role == "visual" || account.id == scenario_.target) continue;
      SiteKind kind = SiteKind::free;
      if (account.tissue == "bone" || account.tissue == "cartilage") kind = SiteKind::hard;
      if (account.tissue == "outside") kind = SiteKind::air;
      if (account.role == "vessel" || account.tissue == "liver" || leaks(account.tissue)) kind = SiteKind::spared;
      if (account.id == carrier) kind = SiteKind::carrier;
      organs.push_back({.surface = &organ.surface, .kind = kind});
    }
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& v : made(carrier).surface.vertices) box.extend(v);
    return {organs, *body_, scenario_.wall, probe_, box, [&] { progress_("placing needle and probe", 0); }};
  }

  void make_balls() {
    for (const SideOrgan& organ : side_.organs) {
      if (organ.ball == 0) continue;
      if (std::ranges::none_of(made_, [&](const Made& other) { return other.side->id == organ.body; })) {
        fail(organ.pointer + "/ball_mm", "lies in an organ, not in the wall; name another body");
      }
      const SiteSearch search = search_about(organ.body);
      double ball = organ.ball;
      auto centre = search.ball(ball / 2);
      while (!centre && ball > kSmallestBall * organ.ball) {
        ball *= 0.8;
        centre = search.ball(ball / 2);
      }
      const double radius = ball / 2;
      if (!centre) {
        fail(organ.pointer + "/ball_mm",
             fmt::format("there is no room for {:.3g} mm in {} that a needle gets to; make it smaller, or choose "
                         "another organ",
                         organ.ball * 1e3, organ.body));
      }
      const auto distance = [&](const Eigen::Vector3d& x) { return (x - *centre).norm() - radius; };
      const Eigen::AlignedBox3d box(centre->array() - 1.5 * radius, centre->array() + 1.5 * radius);
      Made made{.side = &organ,
                .surface = mesh::boundary_surface(mesh::stuff(distance, box, radius / 6, 2)).mesh,
                .account = {.id = organ.id,
                            .role = organ.role,
                            .tissue = organ.tissue.empty() ? kMadeUpTissue : organ.tissue,
                            .body = organ.body,
                            .notes = {fmt::format("made up: a ball of {:.3g} mm, in no scan", ball * 1e3)}}};
      check_tissue(organ.pointer + "/tissue", made.account.tissue);
      scene_.warnings.push_back(
          fmt::format("{} is made up: a ball of {:.3g} mm in {}, in no scan{}", organ.id, ball * 1e3, organ.body,
                      ball < organ.ball ? fmt::format("; there is no room for {:.3g} mm", organ.ball * 1e3) : ""));
      made_.push_back(std::move(made));
    }
  }

  void propose_sites() {
    const std::string& body = made(scenario_.target).side->body;
    const bool in_organ = std::ranges::any_of(made_, [&](const Made& organ) { return organ.side->id == body; });
    const auto sites = search_about(in_organ ? body : scenario_.target).sites(scene_.target, scenario_.entry);
    if (!sites) {
      fail(scenario_.pointer + (scenario_.entry ? "/probe" : "/entry"),
           "no place on the skin will do; say where it is, or choose another target");
    }
    if (!scenario_.entry) scenario_.entry = sites->entry;
    if (!scenario_.probe.at) scenario_.probe.at = sites->probe;
  }

  /// Of a needle along the beam there is nothing in the image.
  void look_at_needle() {
    content::Probe held = probe_;
    held.pose = scene_.probe;
    const double angle = content::angle_to_beam(held, scene_.target, scene_.target - scene_.entry);
    if (angle >= kLeastToBeam) return;
    constexpr double kDegree = std::numbers::pi / 180;
    scene_.warnings.push_back(fmt::format(
        "the needle makes {:.0f} degrees with the ultrasound's beam through the target, less than {:.0f}: "
        "the image shows it faintly, and no better place was found; choose another target, or say in "
        "{}/entry and {}/probe where they are",
        angle / kDegree, kLeastToBeam / kDegree, scenario_.pointer, scenario_.pointer));
  }

  void add_wall() {
    const SideWall& wall = scenario_.wall;
    progress_(wall.id, 0);
    for (std::size_t i = 0; i < wall.layers.size(); ++i) {
      check_tissue(wall.layers[i].pointer + (wall.layers[i].pointer == wall.pointer ? "" : "/tissue"),
                   wall.layers[i].tissue);
    }
    if (!wall.filler.empty()) check_tissue(wall.pointer + "/filler", wall.filler);
    if (field_distance(wall, scene_.entry, scene_.cuts, scene_.entry) > -wall.depth) {
      fail(wall.pointer, fmt::format("its field holds the entry [{:.3f}, {:.3f}, {:.3f}] not, or within less than "
                                     "{:.3g} mm of its rim; widen or move it",
                                     scene_.entry.x(), scene_.entry.y(), scene_.entry.z(), wall.depth * 1e3));
    }
    const Made& skin = made(wall.skin);
    if (!wall.filler.empty()) {
      add({.name = wall.skin, .role = "region", .tissue = wall.filler, .body = {}, .mesh = skin.surface},
          skin.account);
    }
    add({.name = wall.skin + "_outside_field",
         .role = "visual",
         .tissue = wall.layers.front().tissue,
         .body = {},
         .mesh = skin_outside_field(side_, *body_, scene_)},
        {});

    std::vector<std::unique_ptr<Solid>> solids;
    std::vector<const Solid*> inside;
    for (const Made& organ : made_) {
      if (holds_wall(organ.side->id) || organ.side->id == wall.skin || organ.side->role == "visual") continue;
      if (organ.side->body == wall.id) continue;
      solids.push_back(std::make_unique<Solid>(organ.surface));
      inside.push_back(solids.back().get());
    }
    std::vector<WallSurface> layers =
        derive_wall(wall, scene_.entry, *body_, inside, side_.path.string() + ":" + wall.pointer, pulse(wall.id));
    scene_.wall_depth = wall.depth;
    drop_far_holders(layers.front().surface);
    scene_.bodies.push_back({.id = wall.id,
                             .cell = wall.cell,
                             .target_nodes = wall.target_nodes,
                             .element = wall.element,
                             .holds = holds_of_wall(side_, *body_, scene_, layers.front().surface)});
    for (std::size_t i = 0; i < layers.size(); ++i) {
      SceneOrgan account;
      account.notes.push_back(
          i == 0 ? fmt::format("derived: up to {:.3g} mm below the skin, {} organ(s) taken out", wall.depth * 1e3,
                               inside.size())
                 : fmt::format("derived: the wall from {:.3g} mm below the skin on", layers[i].inner_from * 1e3));
      add({.name = i == 0 ? wall.id : fmt::format("{}_{}", wall.id, layers[i].tissue),
           .role = i == 0 ? "boundary" : "region",
           .tissue = layers[i].tissue,
           .body = wall.id,
           .mesh = std::move(layers[i].surface)},
          account);
    }
  }

  /// Of the organs that are to hold the wall, those that are nowhere near it.
  void drop_far_holders(const TriangleMesh& surface) {
    std::erase_if(scenario_.wall.held_by, [&](const std::string& id) {
      const Solid organ(made(id).surface);
      const bool near = std::ranges::any_of(surface.vertices, [&](const Eigen::Vector3d& v) {
        return organ.bounds().exteriorDistance(v) <= scenario_.wall.held_within &&
               organ.signed_distance(v) <= scenario_.wall.held_within;
      });
      if (!near) {
        scene_.warnings.push_back(fmt::format("{} do not hold {}: they lie nowhere within {:.3g} mm of it", id,
                                              scenario_.wall.id, scenario_.wall.held_within * 1e3));
      }
      return !near;
    });
  }

  /// The part of an organ on one side of a distance from its body; empty: nothing there.
  TriangleMesh part_of(const Solid& organ, const Solid& body, double within, double side) const {
    const files::Pulse parting = pulse("parting an organ");
    const auto distance = [&](const Eigen::Vector3d& x) {
      return std::max(organ.signed_distance(x), side * (body.signed_distance(x) - within));
    };
    return mesh::boundary_surface(mesh::stuff(distance, organ.bounds(), kSplitCell, 2, mesh::Parts::largest, parting))
        .mesh;
  }

  void add_organ(Made& organ) {
    const SideOrgan& side = *organ.side;
    if (side.id == scenario_.wall.skin) return;
    if (side.within) {
      const Solid whole(organ.surface);
      const Solid body(side.body == scenario_.wall.id ? surface_of(side.body) : made(side.body).surface);
      TriangleMesh near = part_of(whole, body, *side.within, 1);
      TriangleMesh rest = part_of(whole, body, *side.within, -1);
      if (near.triangles.empty()) {
        fail(side.pointer + "/within_mm", fmt::format("nothing of {} lies within {:.3g} mm of {}; raise it or remove "
                                                      "body",
                                                      side.id, *side.within * 1e3, side.body));
      }
      if (!rest.triangles.empty()) {
        SceneOrgan account = organ.account;
        account.body.clear();
        account.notes.push_back(
            fmt::format("the part farther than {:.3g} mm from {}: rigid", *side.within * 1e3, side.body));
        add({.name = side.id + "_rest", .role = side.role, .tissue = organ.account.tissue, .body = {}, .mesh = rest},
            account);
        organ.account.notes.push_back(fmt::format("the part within {:.3g} mm of {}", *side.within * 1e3, side.body));
        organ.surface = std::move(near);  // nothing is carried by it
      }
    }
    if (side.deformable) {
      std::vector<Hold> holds = holds_of_organ(side, scene_.cuts, organ.surface);
      if (holds.empty()) {
        fail(side.pointer,
             fmt::format("nothing holds {}: the scan does not cut it; name organs it hangs on in held_by", side.id));
      }
      scene_.bodies.push_back({.id = side.id,
                               .cell = side.cell,
                               .target_nodes = side.target_nodes,
                               .element = side.element,
                               .holds = std::move(holds)});
    }
    add({.name = side.id,
         .role = side.role,
         .tissue = organ.account.tissue,
         .body = organ.account.body,
         .mesh = organ.surface},  // a copy: organs that this one carries are parted by it
        organ.account);
  }

  const TriangleMesh& surface_of(const std::string& name) const {
    return std::find_if(scene_.surfaces.begin(), scene_.surfaces.end(),
                        [&](const AnnotatedSurface& surface) { return surface.name == name; })
        ->mesh;
  }

  void add(AnnotatedSurface surface, SceneOrgan account) {
    surface.mesh = thin_out(surface.mesh, kThinOut, pulse("thinning out " + surface.name));
    const mesh::SurfaceReport report = mesh::inspect(surface.mesh);
    account.id = surface.name;
    account.role = surface.role;
    account.tissue = surface.tissue;
    account.body = surface.body;
    account.triangles = surface.mesh.triangles.size();
    account.pieces = report.components;
    if (report.closed()) account.volume = report.volume;
    for (const ScanCut& cut : scene_.cuts) {
      if (surface.role == "visual") break;
      const double area = area_on(cut, surface.mesh);
      if (area < kCutArea) continue;
      account.notes.push_back(
          fmt::format("cut off flat by the end of the scan towards {}: {:.3g} cm2", cut.name(), area * 1e4));
    }
    scene_.surfaces.push_back(std::move(surface));
    scene_.organs.push_back(std::move(account));
  }

  void add_contacts() {
    if (scenario_.contacts) {
      for (const SideContact& contact : *scenario_.contacts) {
        scene_.contacts.emplace_back(contact.nodes_of, contact.surface_of);
      }
      return;
    }
    for (const SceneBody& body : scene_.bodies) {
      if (body.id != scenario_.wall.id) scene_.contacts.emplace_back(body.id, scenario_.wall.id);
    }
  }

  /// Whether an organ holds the wall, and so lies in it on purpose.
  bool holds_wall(const std::string& id) const {
    const auto& held_by = scenario_.wall.held_by;
    return std::find(held_by.begin(), held_by.end(), id) != held_by.end();
  }

  void survey() {
    std::vector<AnnotatedSurface> organs;  // without what is everywhere: the body between the organs
    for (const AnnotatedSurface& surface : scene_.surfaces) {
      if (surface.name != scenario_.wall.skin) organs.push_back(surface);
    }
    scene_.overlaps = find_overlaps(organs);
    std::erase_if(scene_.overlaps, [&](const Overlap& overlap) {
      const auto of_wall = [&](const std::string& name) {
        return std::any_of(organs.begin(), organs.end(), [&](const AnnotatedSurface& surface) {
          return surface.name == name && surface.body == scenario_.wall.id;
        });
      };
      return of_wall(overlap.gives_way) && holds_wall(overlap.counts);
    });
    for (const Overlap& overlap : scene_.overlaps) {
      if (overlap.share < kLargeOverlap) continue;
      scene_.warnings.push_back(fmt::format(
          "{} and {} overlap by {:.0f} % of the smaller: {} counts there; is one part of the other, or named twice?",
          overlap.gives_way, overlap.counts, 100 * overlap.share, overlap.counts));
    }
    scene_.path = find_path(organs, scene_.entry, scene_.target);
    for (const PathPiece& piece : scene_.path) {
      const auto organ = std::find_if(scene_.organs.begin(), scene_.organs.end(),
                                      [&](const SceneOrgan& account) { return account.id == piece.organ; });
      const bool hard = organ->tissue == "bone" || organ->tissue == "cartilage";
      const bool air = organ->tissue == "outside";
      if (!hard && !air && organ->role != "vessel") continue;
      scene_.warnings.push_back(fmt::format(
          "the straight way to the target passes {} ({}) from {:.0f} to {:.0f} mm below the skin; move the entry",
          piece.organ,
          hard  ? organ->tissue
          : air ? "air"
                : "a vessel",
          piece.from * 1e3, piece.to * 1e3));
    }
  }

  const std::vector<SourceFile>& files_;
  SideFile side_;           // completed on the way
  SideScenario& scenario_;  // of it
  bool derives_body_ = false;
  const std::set<std::string>& tissues_;
  const content::Probe& probe_;
  const ImportProgress& progress_;
  std::vector<Made> made_;
  std::vector<std::pair<std::string, std::vector<const SourcePart*>>> parts_of_;  // by organ
  std::unique_ptr<Body> body_;
  ImportedScene scene_;
};

}  // namespace

bool leaks(const std::string& tissue) {
  return tissue == "bile" || tissue == "bowel" || tissue.starts_with("kidney") || tissue == "pancreas" ||
         tissue == "spleen";
}

ImportedScene import_scene(const std::vector<SourceFile>& files, const SideFile& side,
                           const std::set<std::string>& tissues, const content::Probe& probe,
                           const ImportProgress& progress) {
  return SceneImport(files, side, tissues, probe, progress).run();
}

}  // namespace stylet::import
