// What an imported organ leaves on disk, as bytes: tetrahedra, report.
#pragma once

#include "engine/import/organ_import.h"
#include "engine/import/organ_labels.h"

#include <string>

namespace stylet::import {

/// Tetrahedra as a legacy VTK file (ASCII, version 3.0), which ParaView, Gmsh and SOFA open: nodes in metres, patient
/// frame; cell data `min_dihedral_deg` and, with labels, `tissue` and `young_modulus_pa`. Numbers survive the round
/// trip; the same organ gives the same bytes.
std::string tetrahedra_vtk(const ImportedOrgan& organ, const OrganLabels* labels = nullptr);

/// The report as JSON, in SI units and degrees.
std::string report_json(const ImportedOrgan& organ, const OrganParts& parts);

/// The report as a page of text for people.
std::string report_text(const ImportedOrgan& organ, const OrganParts& parts);

}  // namespace stylet::import
