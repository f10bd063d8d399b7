#include "global_ba/ba_problem.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

constexpr int kMinObservations = 2;
constexpr int kIterationsAPiece = 4;

}  // namespace

void DropUnderobservedLandmarks(BaWorld* world) {
  std::vector<int> count(world->landmarks.size(), 0);
  for (const BaObservation& seen : world->observations) {
    ++count[seen.landmark];
  }
  std::vector<int> new_index(count.size(), -1);
  std::vector<Eigen::Vector3d> kept;
  for (size_t i = 0; i < count.size(); ++i) {
    if (count[i] >= kMinObservations) {
      new_index[i] = static_cast<int>(kept.size());
      kept.push_back(world->landmarks[i]);
    }
  }
  std::erase_if(world->observations,
                [&](const BaObservation& seen) { return new_index[seen.landmark] < 0; });
  for (BaObservation& seen : world->observations) {
    seen.landmark = new_index[seen.landmark];
  }
  world->landmarks = std::move(kept);
}

BaProblem::BaProblem(BaWorld world, const BaOptions& options)
    : options_(options), world_(std::move(world)) {
  Begin();
}

void BaProblem::Begin() {
  const auto kind =
      round_ == Round::kFindOutliers ? RobustLoss::Kind::kCauchy : RobustLoss::Kind::kHuber;
  solver_ = std::make_unique<BaSolver>(world_, options_,
                                       RobustLoss{.kind = kind, .scale = options_.loss_scale});
  iterations_ = 0;
}

bool BaProblem::Advance() {
  if (round_ == Round::kDone) {
    return false;
  }
  auto outcome = BaSolver::Outcome::kGoesOn;
  for (int i = 0; i < kIterationsAPiece && outcome == BaSolver::Outcome::kGoesOn; ++i) {
    outcome = iterations_++ < options_.max_iterations ? solver_->Iterate()
                                                      : BaSolver::Outcome::kConverged;
  }
  cost_ = solver_->cost();
  solver_->ReadBack(&world_);
  if (outcome == BaSolver::Outcome::kGoesOn) {
    return true;
  }
  if (round_ == Round::kEstimate) {
    round_ = Round::kDone;
    solver_.reset();
    return false;
  }
  DropOutliers();
  round_ = Round::kEstimate;
  Begin();
  return true;
}

void BaProblem::DropOutliers() {
  std::erase_if(world_.observations, [this](const BaObservation& seen) {
    return solver_->Residual(seen).squaredNorm() > options_.max_chi2;
  });
  DropUnderobservedLandmarks(&world_);
}

}  // namespace pangea
