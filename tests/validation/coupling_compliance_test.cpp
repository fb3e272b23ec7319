// The IsoDOFs form of W, kept up to date from contact to contact and factor to factor, against a dense inverse.
#include "physics/contact/delassus.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/isolated_dofs.h"
#include "tests/support/dense_tissue.h"
#include "tests/support/sanitized.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace stylet::validation {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using physics::ActiveContact;
using physics::BodyPatch;

constexpr int kCapacity = 48;      // isolated nodes: fewer than are touched in time, so some must be forgotten
constexpr int kMostContacts = 12;  // of four nodes each

/// Random steps with an irregular cube: contacts come and go, directions turn, the tissue is factorised anew in
/// another deformed state. What is under test and what it is compared with share the mesh and the contacts alone.
class RandomSequence {
public:
  explicit RandomSequence(unsigned seed)
      : random_(seed),
        mesh_(irregular_cube(seed)),
        materials_(mesh_.tets.size(), {10e3, 0.45}),
        fixed_(reference::nodes_where(mesh_, [](const Vector3d& x) { return x.z() < 1e-9; })),
        model_(mesh_, materials_, fixed_),
        pattern_(model_),
        factor_(pattern_, workspace_),
        isolated_(model_.node_count(), kCapacity),
        dense_(mesh_, materials_, fixed_),
        needle_(properties_, {}) {
    patch_.body_count = 1;
    needle_.linearise(physics::straight_needle(properties_, {}), {}, 1e-3);
    add();
    refactorise();
  }

  void add() {
    if (contacts_.size() == kMostContacts) return remove();
    physics::PatchContact contact;
    contact.id = next_id_++;
    contact.tet = std::uniform_int_distribution<int>(0, model_.tet_count() - 1)(random_);
    contact.barycentric = (vector<4>().array() + 1).matrix();
    contact.barycentric /= contact.barycentric.sum();
    contacts_.push_back(contact);
    ++added;
  }
  void remove() {
    if (contacts_.size() == 1) return add();
    contacts_.erase(contacts_.begin() +
                    std::uniform_int_distribution<std::ptrdiff_t>(0, std::ssize(contacts_) - 1)(random_));
    ++removed;
  }
  /// At a state that turns tetrahedra by tens of degrees.
  void refactorise() {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(vector<1>()[0], vector<3>().normalized()).toRotationMatrix();
    Eigen::Matrix3Xd positions = physics::rest_positions(model_);
    for (Eigen::Index n = 0; n < positions.cols(); ++n) {
      positions.col(n) += positions(2, n) / 0.1 * (turn * positions.col(n) - positions.col(n)) + 1e-3 * vector<3>();
    }
    std::vector<Eigen::Quaterniond> rotations(model_.tets.size(), Eigen::Quaterniond::Identity());
    physics::update_rotations(model_, positions, rotations);
    for (const auto& r : rotations)
      largest_turn = std::max(largest_turn, r.angularDistance(Eigen::Quaterniond::Identity()));
    std::vector<double> values(pattern_.nonzeros());
    pattern_.assemble(model_, rotations, 1, values);
    ASSERT_TRUE(factor_.factorise(pattern_, values, workspace_));
    isolated_.clear();
    inverse_ = reference::inverse(dense_.free_stiffness(positions.reshaped()));
    ++factorised;
  }

  /// |W - H A^-1 H^T| over |H A^-1 H^T|, for new random directions.
  double error() {
    fill_patch();
    EXPECT_TRUE(points_.load(patch_));
    // At the clamped hub, where the needle does not yield: W is the tissue's part alone.
    std::vector<ActiveContact> active;
    for (int c = 0; c < points_.count(); ++c) {
      const Eigen::Matrix3d frame = Eigen::Quaterniond(vector<4>().normalized()).toRotationMatrix();
      active.push_back(physics::lateral_contact(c, 2 * c, {}, frame.leftCols<2>()));
    }
    delassus_.assemble(needle_, points_, active, points_.count());
    const MatrixXd w = MatrixXd(delassus_.matrix()).selfadjointView<Eigen::Lower>();

    MatrixXd h = MatrixXd::Zero(w.rows(), 3 * Eigen::Index(mesh_.nodes.size()));
    for (Eigen::Index c = 0; c < std::ssize(contacts_); ++c) {
      const physics::PatchContact& contact = contacts_[c];
      for (int a = 0; a < 4; ++a) {
        h.block<2, 3>(2 * c, 3 * mesh_.tets[contact.tet][a]) -= contact.barycentric[a] * active[c].rows().transpose();
      }
    }
    const MatrixXd h_free = h(Eigen::all, dense_.free_dofs());
    const MatrixXd exact = reference::product(h_free, reference::product(inverse_, h_free.transpose()));
    return (w - exact).norm() / exact.norm();
  }

  int added = 0;
  int removed = 0;
  int factorised = 0;
  int computed = 0;  ///< nodes whose compliance was solved for
  int asked = 0;     ///< nodes whose compliance was wanted, summed over the steps
  double largest_turn = 0;

private:
  static physics::TetMesh irregular_cube(unsigned seed) {
    physics::TetMesh mesh = reference::kuhn_box(Vector3d::Zero(), Vector3d::Constant(0.1), {4, 4, 4});
    reference::jitter_inner_nodes(mesh, 0.004, seed);
    return mesh;
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector() {  // in [-1, 1]
    std::uniform_real_distribution<double> uniform(-1, 1);
    return Eigen::Matrix<double, N, 1>::NullaryExpr([&] { return uniform(random_); });
  }
  void fill_patch() {
    std::vector<int> nodes;
    for (const auto& contact : contacts_) {
      const auto& tet = mesh_.tets[contact.tet];
      nodes.insert(nodes.end(), tet.begin(), tet.end());
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    computed += isolated_.isolate(nodes, model_, factor_, workspace_);
    asked += int(nodes.size());

    BodyPatch& body = patch_.bodies[0];
    ++patch_.epoch;
    body.node_count = int(nodes.size());
    std::copy(nodes.begin(), nodes.end(), body.node_ids.begin());
    MatrixXd w_bar(3 * body.node_count, 3 * body.node_count);
    isolated_.gather(nodes, w_bar);
    body.set_w_bar(w_bar);
    body.contact_count = int(contacts_.size());
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      for (std::size_t a = 0; a < 4; ++a) {
        const int node = mesh_.tets[contacts_[c].tet][a];
        contacts_[c].patch_nodes[a] = int(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
      }
      body.contacts[c] = contacts_[c];
    }
    body.condense();
  }

  std::mt19937 random_;
  physics::TetMesh mesh_;
  std::vector<physics::ElasticMaterial> materials_;
  std::vector<int> fixed_;
  physics::TissueModel model_;
  physics::StiffnessPattern pattern_;
  physics::SolveWorkspace workspace_;
  physics::Factorisation factor_;
  physics::IsolatedDofs isolated_;
  support::DenseTissue dense_;
  MatrixXd inverse_;
  physics::NeedleProperties properties_;
  physics::Needle needle_;
  std::vector<physics::PatchContact> contacts_;
  std::uint32_t next_id_ = 1;
  physics::TissuePatch patch_;
  physics::TissuePoints points_;
  physics::Delassus delassus_{9, physics::kMaxRows};
};

TEST(Coupling, IsolatedDofsGiveTheDenseDelassusOperatorThroughAnySequence) {
  double worst = 0;
  int added = 0;
  int removed = 0;
  int factorised = 0;
  for (unsigned seed = 1; seed <= (support::kSanitized ? 1U : 3U); ++seed) {
    RandomSequence sequence(seed);
    std::mt19937 random(seed + 100);
    for (int step = 0; step < 150; ++step) {
      const double u = std::uniform_real_distribution<double>(0, 1)(random);
      if (u < 0.12) {
        sequence.refactorise();
      } else if (u < 0.6) {
        sequence.add();
      } else {
        sequence.remove();
      }
      const double error = sequence.error();
      ASSERT_LT(error, 1e-9) << "seed " << seed << ", step " << step;  // lost track; rounding is judged below
      worst = std::max(worst, error);
    }
    EXPECT_LT(sequence.computed, sequence.asked / 2);  // most are known from the steps before
    EXPECT_GT(sequence.largest_turn, 0.3);
    added += sequence.added;
    removed += sequence.removed;
    factorised += sequence.factorised;
  }
  std::printf("  %d contacts added, %d removed, %d factorisations\n", added, removed, factorised);
  report_residual("W by isolated DOFs off H A^-1 H^T", worst, 1e-12);
}

}  // namespace
}  // namespace stylet::validation
