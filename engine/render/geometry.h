// The scene's surfaces, probe and needle packed into one vertex and one index buffer, and what is drawn from them.
#pragma once

#include "engine/content/heated_zone.h"
#include "engine/content/scene.h"
#include "engine/render/cable_mesh.h"
#include "engine/render/needle_mesh.h"
#include "engine/render/rod_mesh.h"
#include "engine/render/room_layout.h"
#include "engine/render/thinning.h"
#include "shaders/shared.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::render {

/// A range of the index buffer drawn in one style.
struct Piece {
  std::string name;
  std::uint32_t first_index = 0;
  std::uint32_t index_count = 0;
  SurfaceStyle style{};
  std::vector<std::uint32_t>
      samples;          ///< a few of its vertices as carried by nodes, to sort translucent pieces by depth
  bool target = false;  ///< an opaque one, that is also in Geometry::glass_targets
};

/// Rest geometry of a scene as the GPU holds it. Vertices [0, rest.size()) are placed by deform.comp: those of the
/// scene, then room for those of a zone that is ablated. The needle's, the cores', the syringe's, the shot's, the
/// controllers' and the cable's follow and come from the host every frame.
struct Geometry {
  /// Of a zone: 10 cm of electrode make a tenth of it.
  static constexpr std::uint32_t kMostZoneVertices = 1 << 16;

  /// @param layout  of the room; null: none is drawn
  explicit Geometry(const content::Scene& scene, const RoomLayout* layout = nullptr, const Detail& wanted = {});

  Detail detail;  ///< in which its surfaces are
  std::vector<RestVertex> rest;
  std::vector<std::uint32_t> indices;       ///< into rest and needle vertices, as one
  std::vector<Eigen::Vector3f> rest_nodes;  ///< of all bodies, one body after the other; never empty
  std::vector<std::size_t> body_node_count;
  /// Of the cavity's wall, as cavity_rings() has them; none without a room.
  std::vector<Eigen::Vector3f> cavity_rings;
  std::vector<Piece> solids;         ///< opaque organs, bone; the probe is the last
  std::vector<Piece> needle_pieces;  ///< shaft and hub
  std::vector<Piece> glass;          ///< translucent organs, in the order of the scene
  std::vector<Piece> glass_targets;  ///< opaque targets once more, as glass: what is shot into them is seen
  std::vector<Piece> covers;         ///< skin, fat, muscle: what is cut open towards the focus
  std::vector<Piece> lining;         ///< skin that is made up below theirs; none without a room
  std::vector<Piece> room;           ///< furniture; empty without a room
  std::vector<Piece> panel;          ///< the session's monitor, drawn where it has a picture
  std::vector<Piece> drape;          ///< cloth, or nothing
  std::vector<Piece> drape_closed;   ///< its triangles that the field nowhere opens
  std::vector<Piece> drape_open;     ///< the others
  std::vector<Piece> cavity;         ///< inside of the trunk, wall and ends, or nothing
  Piece panel_picture;
  Piece fan;
  Piece zone;  ///< of no triangles; where they go in a scene that ablates
  NeedleMesh needle;
  std::uint32_t zone_base = 0;    ///< first vertex of the zone
  std::uint32_t zone_room = 0;    ///< vertices that it may have; half as many as its triangles
  std::uint32_t needle_base = 0;  ///< first vertex of the needle
  static constexpr std::size_t kMostCores = 20;
  RodMesh cores{kMostCores};
  Piece core_piece;                   ///< of all the cores that may be
  std::uint32_t core_base = 0;        ///< their first vertex
  RodMesh syringe;                    ///< of no rods in a scene without cavities
  std::vector<Piece> syringe_pieces;  ///< fluid, seal, plunger and nozzle
  Piece barrel;
  std::uint32_t syringe_base = 0;  ///< its first vertex
  RodMesh shot{kShotParts};
  Piece shot_piece;             ///< stylet and cannula of a biopsy needle that is fired
  std::uint32_t shot_base = 0;  ///< their first vertex
  RodMesh hands{2 * kControllerParts};
  std::array<Piece, 2> hand_pieces;  ///< controllers: that of the needle, that of the probe
  std::uint32_t hand_base = 0;       ///< their first vertex
  std::optional<CableMesh> cable;    ///< of the probe; none without a room
  Piece cable_piece;
  std::uint32_t cable_base = 0;  ///< its first vertex

  /// Of everything.
  std::size_t vertex_count() const {
    return rest.size() + needle.vertex_count() + cores.vertex_count() + syringe.vertex_count() + shot.vertex_count() +
           hands.vertex_count() + (cable ? cable->vertex_count() : 0);
  }
  Piece first_cores(std::size_t count) const {
    Piece piece = core_piece;
    piece.index_count = RodMesh::index_count(count);
    return piece;
  }

  const Piece& probe() const { return solids.back(); }
};

/// A zone as the GPU holds it.
struct ZoneGeometry {
  std::vector<RestVertex> rest{};
  std::vector<std::uint32_t> indices{};  ///< as Geometry::indices
  Piece piece{};
};
/// What goes beyond the room in `geometry` is left out.
ZoneGeometry zone_geometry(const content::HeatedZone& zone, const Geometry& geometry);

/// Node positions, each body's where they lie.
using BodyNodes = std::vector<std::span<const Eigen::Vector3f>>;

/// Position of a rest vertex for given node positions, patient frame, breathed out. For probe vertices: the probe
/// frame.
Eigen::Vector3f place(const RestVertex& vertex, const BodyNodes& bodies);

}  // namespace stylet::render
