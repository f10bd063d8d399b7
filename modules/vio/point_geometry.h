#pragma once

// Points seen from the window's camera poses: projection with its derivatives, triangulation,
// change of anchor. Rays are on the plane z = 1; sigmas are in that plane's unit (pixel sigma times
// the angle of a pixel).

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "vio/window_filter.h"
#include "vio/window_state.h"

namespace pangea::vio {

// An observation of one point in one clone.
struct ClonedRay {
  int clone = 0;  // index into WindowState::clones
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  double sigma = 0;
};

// Where a point should be seen. Derivatives, when asked for: 2 x state.size() for the poses and the
// calibration (the point's own columns stay zero), 2 x 3 for the point's (alpha, beta, rho).
struct PredictedRay {
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, Eigen::Dynamic> H_x;
  Eigen::Matrix<double, 2, 3> H_f;
};
// Nothing when the point is behind the camera. The anchor must be in the window.
std::optional<PredictedRay> PredictRay(const WindowState& state, const AnchoredPoint& point,
                                       int clone, bool with_derivatives);

struct Triangulated {
  AnchoredPoint point;
  Eigen::Matrix3d covariance;  // of (alpha, beta, rho), poses taken as exact
  double rms = 0;              // whitened residual
};
// From at least two rays; the anchor is `anchor_clone`. Nothing when the depth is not determined or
// out of range.
std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const ClonedRay> rays,
                                        int anchor_clone);

// All rays of a point as one measurement r = H_x x + H_f f + n, whitened (sigma 1). Nothing when
// one is behind.
struct PointMeasurement {
  Measurement x;
  Eigen::MatrixXd H_f;
};
std::optional<PointMeasurement> MeasurePoint(const WindowState& state, const AnchoredPoint& point,
                                             std::span<const ClonedRay> rays);

// The measurement with the point eliminated: its rows orthogonal to H_f (Mourikis & Roumeliotis,
// eq. 23).
Measurement WithoutPoint(const PointMeasurement& m);

// The same point anchored in another clone, and d(new coordinates)/d(state incl. the landmark at
// `landmark`).
struct Reanchored {
  AnchoredPoint point;
  Eigen::MatrixXd J;  // 3 x state.size()
};
std::optional<Reanchored> Reanchor(const WindowState& state, int landmark, int new_anchor_clone);

}  // namespace pangea::vio
