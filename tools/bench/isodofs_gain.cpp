#include "tools/bench/isodofs_gain.h"

#include "physics/tissue/isolated_dofs.h"

#include <algorithm>
#include <span>
#include <vector>

namespace stylet::bench {
namespace {

using physics::BodyPatch;
using physics::PatchContact;
using physics::TissueModel;

std::span<const PatchContact> contacts_of(const BodyPatch& patch) {
  return {patch.contacts.data(), static_cast<std::size_t>(patch.contact_count)};
}

/// Nodes of the tetrahedra of the contacts, ascending.
std::vector<int> nodes_of(std::span<const PatchContact> contacts, const BodyPatch& patch) {
  std::vector<int> nodes;
  for (const PatchContact& contact : contacts) {
    for (const int place : contact.patch_nodes) nodes.push_back(patch.node_ids[place]);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

/// W[r, s] = h_r A^-1 h_s^T, a solve for every s, as without isolated DOFs. m/N
Eigen::MatrixXd delassus_by_row_solves(const TissueModel& model, const physics::Factorisation& factor,
                                       const BodyPatch& patch, physics::SolveWorkspace& workspace) {
  const auto contacts = contacts_of(patch);
  const auto rows = static_cast<Eigen::Index>(2 * contacts.size());
  // Row r of H: its direction times the barycentric weights, on the free nodes of the tetrahedron.
  const auto visit = [&](Eigen::Index r, const auto& entry) {
    const PatchContact& contact = contacts[r / 2];
    for (int a = 0; a < 4; ++a) {
      const int node = patch.node_ids[contact.patch_nodes[a]];
      const int free = model.free_index[node];
      if (free >= 0) entry(3 * free, Eigen::Vector3d(contact.barycentric[a] * contact.directions.col(r % 2)));
    }
  };
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(rows, rows);
  Eigen::VectorXd x(model.dof_count());
  for (Eigen::Index s = 0; s < rows; ++s) {
    x.setZero();
    visit(s, [&](int dof, const Eigen::Vector3d& h) { x.segment<3>(dof) += h; });
    factor.solve(x, x, workspace);
    for (Eigen::Index r = 0; r < rows; ++r) {
      visit(r, [&](int dof, const Eigen::Vector3d& h) { w(r, s) += h.dot(x.segment<3>(dof)); });
    }
  }
  return w;
}

/// W = H W_bar H^T, W_bar of the patch's nodes in their order   (paper eq. 5).
Eigen::MatrixXd delassus_of(const BodyPatch& patch, const Eigen::MatrixXd& w_bar) {
  const auto contacts = contacts_of(patch);
  const auto rows = static_cast<Eigen::Index>(2 * contacts.size());
  Eigen::MatrixXd w(rows, rows);
  for (std::size_t j = 0; j < contacts.size(); ++j) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      Eigen::Matrix3d compliance = Eigen::Matrix3d::Zero();
      for (int b = 0; b < 4; ++b) {
        for (int a = 0; a < 4; ++a) {
          compliance += (contacts[i].barycentric[a] * contacts[j].barycentric[b]) *
                        w_bar.block<3, 3>(3 * contacts[i].patch_nodes[a], 3 * contacts[j].patch_nodes[b]);
        }
      }
      w.block<2, 2>(static_cast<Eigen::Index>(2 * i), static_cast<Eigen::Index>(2 * j)) =
          contacts[i].directions.transpose() * compliance * contacts[j].directions;
    }
  }
  return w;
}

}  // namespace

IsodofsGain measure_isodofs_gain(const TissueModel& model, const physics::Factorisation& factor,
                                 const BodyPatch& patch, int repetitions) {
  IsodofsGain gain;
  gain.rows = 2 * patch.contact_count;
  physics::SolveWorkspace workspace;
  const std::vector<int> nodes(patch.node_ids.begin(), patch.node_ids.begin() + patch.node_count);
  const auto contacts = contacts_of(patch);
  const std::vector<int> nodes_before = nodes_of(contacts.first(contacts.size() - 1), patch);

  physics::IsolatedDofs before(model.node_count(), physics::kMaxPatchNodes);  // the deepest contact is not laid yet
  before.isolate(nodes_before, model, factor, workspace);
  physics::IsolatedDofs isolated(model.node_count(), physics::kMaxPatchNodes);
  Eigen::MatrixXd w_bar = Eigen::MatrixXd::Zero(3 * patch.node_count, 3 * patch.node_count);
  Eigen::MatrixXd reference, w;
  const auto by_isolated_dofs = [&] {
    isolated.isolate(nodes, model, factor, workspace);
    isolated.gather(nodes, w_bar);
    w = delassus_of(patch, w_bar);
  };
  const auto compare = [&] {
    const double error = (w - reference).cwiseAbs().maxCoeff() / reference.cwiseAbs().maxCoeff();
    gain.residual = std::max(gain.residual, error);
  };
  for (int i = 0; i < repetitions; ++i) {
    gain.row_solves.time([&] { reference = delassus_by_row_solves(model, factor, patch, workspace); });
    isolated.clear();
    gain.from_scratch.time(by_isolated_dofs);
    compare();
    gain.unchanged.time(by_isolated_dofs);
    compare();
    isolated = before;
    gain.incremental.time(by_isolated_dofs);
    compare();
  }
  return gain;
}

}  // namespace stylet::bench
