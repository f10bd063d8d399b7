#include "loop_verification/tags/tag_problem.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "core/least_squares/levenberg_marquardt.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/window.h"

namespace pangea {
namespace {

// Of a corner, per axis: libapriltag fits lines to the edges. Includes the errors of a calibration.
constexpr double kTagCornerSigma_px = 0.4;
// Least sigma of each odometry's roll and pitch, radians.
constexpr double kTiltFloor = 0.003;

using Matrix23d = Eigen::Matrix<double, 2, 3>;

Eigen::Vector3d CornerOf(double log_size, int corner) {
  const auto& [x, y] = kTagCornerSigns[static_cast<size_t>(corner)];
  return 0.5 * std::exp(log_size) * Eigen::Vector3d(x, y, 0);
}

Matrix6d RotatedBlocks(const Matrix6d& covariance, const Eigen::Matrix3d& R) {
  Matrix6d blocks = Matrix6d::Zero();
  blocks.topLeftCorner<3, 3>() = blocks.bottomRightCorner<3, 3>() = R;
  return blocks * covariance * blocks.transpose();
}

}  // namespace

TagWindow MakeTagWindow(const KeyframeWindow& frames) {
  TagWindow window;
  const Keyframe& newest = frames.back()->keyframe();
  window.T_w_body = PosesAlongEdges(frames);
  for (size_t i = 0; i < frames.size(); ++i) {
    const Keyframe& keyframe = frames[i]->keyframe();
    window.cameras.push_back(keyframe.camera);
    if (i > 0) {
      window.edges.push_back({window.T_w_body[i].t, RotatedBlocks(keyframe.edge->covariance,
                                                                  window.T_w_body[i - 1].R())});
    }
  }
  const double unknown = UnknownScaleSigma(newest.scale_sigma);
  window.scale_sigma = unknown > 0 ? unknown : kWindowScaleSigma;
  window.tilt_variance = newest.roll_pitch_covariance.trace() / 2 + kTiltFloor * kTiltFloor;
  return window;
}

// A corner as its view sees it.
struct TagProblem::CornerAt {
  Eigen::Vector2d pixel;
  Matrix23d d_p_w;            // d(pixel) / d(point in the view's window frame)
  Eigen::Vector3d p_w;        // the point in the view's window frame
  Eigen::Vector3d arm_m;      // from the tag's centre to the corner, axes of m
  Eigen::Vector3d camera_ds;  // d(camera's position in the window) / d(log scale)
};

std::optional<TagProblem::CornerAt> TagProblem::See(const TagEstimate& at, const TagView& view,
                                                    int corner) const {
  const TagWindow& window = windows_[static_cast<size_t>(view.window)];
  const auto frame = static_cast<size_t>(view.frame);
  const auto tag = static_cast<size_t>(view.tag);
  CornerAt seen;
  seen.arm_m = at.T_m_tag[tag].q * CornerOf(at.log_size[tag], corner);
  const Eigen::Vector3d p_m = at.T_m_tag[tag].t + seen.arm_m;
  seen.p_w = view.window == 0 ? p_m : at.T_m_c.Inverse() * p_m;
  const Rigid3& T_w_body = window.T_w_body[frame];
  seen.camera_ds = std::exp(at.log_scale[static_cast<size_t>(view.window)]) * T_w_body.t;
  const Rigid3 T_w_cam = Rigid3(T_w_body.q, seen.camera_ds) * window.cameras[frame].T_body_cam;
  Matrix23d d_p_cam;
  const auto pixel = window.cameras[frame].Project(T_w_cam.Inverse() * seen.p_w, &d_p_cam);
  if (!pixel) {
    return std::nullopt;
  }
  seen.pixel = *pixel;
  seen.d_p_w = d_p_cam * T_w_cam.R().transpose();
  return seen;
}

std::optional<Eigen::VectorXd> TagProblem::Residuals(const TagEstimate& at,
                                                     Eigen::MatrixXd* jacobian) const {
  const auto num_tags = static_cast<int>(sizes_.size());
  const int num_corners = 2 * kTagCorners * static_cast<int>(views_.size());
  const int first_size = 6 + 6 * num_tags, first_scale = first_size + num_tags;
  Eigen::VectorXd r(num_corners + 2 + num_tags + 2);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(r.size(), num_columns());
  int row = 0;
  const Eigen::Matrix3d R_c_m = at.T_m_c.R().transpose();
  for (const TagView& view : views_) {
    for (int k = 0; k < kTagCorners; ++k, row += 2) {
      const auto seen = See(at, view, k);
      if (!seen) {
        return std::nullopt;
      }
      r.segment<2>(row) = seen->pixel - view.pixels[static_cast<size_t>(k)];
      const Matrix23d d_p_m = view.window == 0 ? seen->d_p_w : Matrix23d(seen->d_p_w * R_c_m);
      const auto tag = static_cast<size_t>(view.tag);
      if (view.window == 1) {
        const Eigen::Vector3d p = at.T_m_tag[tag].t + seen->arm_m - at.T_m_c.t;
        J.block<2, 3>(row, 0) = -d_p_m;
        J.block<2, 3>(row, 3) = d_p_m * Hat(p);
      }
      J.block<2, 3>(row, 6 + 6 * view.tag) = d_p_m;
      J.block<2, 3>(row, 9 + 6 * view.tag) = -d_p_m * Hat(seen->arm_m);
      J.block<2, 1>(row, first_size + view.tag) = d_p_m * seen->arm_m;
      J.block<2, 1>(row, first_scale + view.window) = -seen->d_p_w * seen->camera_ds;
    }
  }
  const double tilt_sigma = std::sqrt(windows_[0].tilt_variance + windows_[1].tilt_variance);
  const Eigen::Vector3d up = at.T_m_c.q * Eigen::Vector3d::UnitZ();
  r.segment<2>(row) = Eigen::Vector2d(-up.y(), up.x()) / tilt_sigma;
  J.block<1, 3>(row, 3) = Hat(up).row(1) / tilt_sigma;
  J.block<1, 3>(row + 1, 3) = -Hat(up).row(0) / tilt_sigma;
  row += 2;
  for (int tag = 0; tag < num_tags; ++tag, ++row) {
    const SizePrior& prior = sizes_[static_cast<size_t>(tag)];
    r[row] = (at.log_size[static_cast<size_t>(tag)] - prior.log_size) / prior.sigma;
    J(row, first_size + tag) = 1 / prior.sigma;
  }
  for (int window = 0; window < 2; ++window, ++row) {
    const double sigma = windows_[static_cast<size_t>(window)].scale_sigma;
    r[row] = at.log_scale[static_cast<size_t>(window)] / sigma;
    J(row, first_scale + window) = 1 / sigma;
  }
  if (jacobian != nullptr) {
    *jacobian = std::move(J);
  }
  return r;
}

TagEstimate TagProblem::Moved(const TagEstimate& from, const Eigen::VectorXd& step) const {
  TagEstimate moved = from;
  moved.T_m_c = from.T_m_c.Plus(step.head<6>());
  const auto num_tags = static_cast<int>(sizes_.size());
  for (int tag = 0; tag < num_tags; ++tag) {
    const auto i = static_cast<size_t>(tag);
    moved.T_m_tag[i] = from.T_m_tag[i].Plus(step.segment<6>(6 + 6 * tag));
    moved.log_size[i] += step[6 + 6 * num_tags + tag];
  }
  moved.log_scale[0] += step[step.size() - 2];
  moved.log_scale[1] += step[step.size() - 1];
  return moved;
}

// An error of an edge moves what the frames before its end see: by the translation, and by the
// rotation about the body at its end.
std::optional<Eigen::MatrixXd> TagProblem::Covariance(const TagEstimate& at) const {
  const int size = 2 * kTagCorners * static_cast<int>(views_.size());
  Eigen::MatrixXd covariance =
      kTagCornerSigma_px * kTagCornerSigma_px * Eigen::MatrixXd::Identity(size, size);
  for (int window = 0; window < 2; ++window) {
    const TagWindow& of = windows_[static_cast<size_t>(window)];
    for (size_t edge = 0; edge < of.edges.size(); ++edge) {
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(size, 6);
      int row = 0;
      for (const TagView& view : views_) {
        for (int k = 0; k < kTagCorners; ++k, row += 2) {
          if (view.window != window || view.frame > static_cast<int>(edge)) {
            continue;
          }
          const auto seen = See(at, view, k);
          if (!seen) {
            return std::nullopt;
          }
          J.block<2, 3>(row, 0) = seen->d_p_w;
          J.block<2, 3>(row, 3) = -seen->d_p_w * Hat(seen->p_w - of.edges[edge].p_w_to);
        }
      }
      covariance += J * of.edges[edge].covariance * J.transpose();
    }
  }
  return covariance;
}

namespace {

struct Equations {
  double cost = 0;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

// Decorrelates the corners' residuals, and the rows of a Jacobian likewise.
struct Whitening {
  Eigen::LLT<Eigen::MatrixXd> corners;

  template <typename Rows>
  void Apply(Rows* rows) const {
    const Eigen::Index size = corners.rows();
    rows->topRows(size) = corners.matrixL().solve(rows->topRows(size)).eval();
  }
};

// As LevenbergMarquardt wants it.
struct Iterate {
  TagEstimate at;
  const TagEstimate& Estimate() const { return at; }
  void SetEstimate(TagEstimate estimate) { at = std::move(estimate); }
};

}  // namespace

std::optional<TagProblem::Solution> TagProblem::Solve(TagEstimate start, bool coarse) const {
  constexpr LevenbergMarquardtOptions kOptions{
      .max_iterations = 30, .max_retries = 8, .min_decrease = 1e-6, .tolerance = 1e-12};
  Iterate iterate{std::move(start)};
  Solution solution;
  const int size = 2 * kTagCorners * static_cast<int>(views_.size());
  // The second time with the odometry's errors at the solution.
  for (int round = 0; round < (coarse ? 1 : 2); ++round) {
    constexpr double kCoarseSigma_px = 2;
    const auto covariance =
        coarse ? std::optional<Eigen::MatrixXd>(kCoarseSigma_px * kCoarseSigma_px *
                                                Eigen::MatrixXd::Identity(size, size))
               : Covariance(iterate.at);
    if (!covariance) {
      return std::nullopt;
    }
    const Whitening whitening{Eigen::LLT<Eigen::MatrixXd>(*covariance)};
    const auto cost_of = [&](const Iterate& one) {
      auto r = Residuals(one.at, nullptr);
      if (!r) {
        return double{INFINITY};
      }
      whitening.Apply(&*r);
      return 0.5 * r->squaredNorm();
    };
    const auto linearise = [&](const Iterate& one, double /*damping*/) {
      Eigen::MatrixXd J;
      auto r = Residuals(one.at, &J);
      whitening.Apply(&*r);
      whitening.Apply(&J);
      return Equations{0.5 * r->squaredNorm(), J.transpose() * J, J.transpose() * *r};
    };
    if (!Residuals(iterate.at, nullptr)) {
      return std::nullopt;
    }
    const auto result = LevenbergMarquardt(
        kOptions, linearise,
        [](const Iterate&, const Equations& equations) -> Eigen::VectorXd {
          return SolveScaled(equations.H, equations.g);
        },
        [this](const Equations&, const Eigen::VectorXd& step, Iterate* one) {
          one->at = Moved(one->at, step);
        },
        cost_of, &iterate);
    solution.chi2 = 2 * result.cost;
    if (round > 0) {
      const Eigen::MatrixXd H = linearise(iterate, 0).H;
      solution.covariance = SolveScaled(H, Eigen::MatrixXd::Identity(H.rows(), H.cols()));
    }
  }
  const auto r = Residuals(iterate.at, nullptr);
  if (!r || !std::isfinite(solution.chi2)) {
    return std::nullopt;
  }
  solution.rms_px = std::sqrt(r->head(size).squaredNorm() / (size / 2.0));
  solution.degrees_of_freedom = static_cast<int>(r->size()) - num_columns();
  solution.estimate = std::move(iterate.at);
  return solution;
}

}  // namespace pangea
