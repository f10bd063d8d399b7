#pragma once

// The least-squares problem of two windows that see the same tags:
//
//   min  |r_corners|^2 + |r_tilt|^2 + sum |r_size|^2 + sum |r_scale|^2
//
// over T_m_c, the pose of each tag in window frame m and its size, and the scale of each window's
// odometry. A tag has the same size in both windows, so it does not have to be known. The keyframes
// of a window are not variables: the errors of the odometry between them are part of the corners'
// covariance, to first order. So the corners of one window have
// correlated errors, those of different windows do not.

#include <array>
#include <optional>
#include <vector>

#include "core/keyframe_store.h"
#include "core/tags/tag.h"

namespace pangea {

// One keyframe's view of a tag. Window frames: window.h.
struct TagView {
  int window = 0;  // 0: m, 1: c
  int frame = 0;   // index into the window
  int tag = 0;     // index into the problem's tags
  std::array<Eigen::Vector2d, kTagCorners> pixels;
};

// A window's odometry edge, from one of its frames to the next.
struct TagWindowEdge {
  Eigen::Vector3d p_w_to = Eigen::Vector3d::Zero();  // the next frame's body
  Matrix6d covariance = Matrix6d::Zero();            // (translation, rotation), in window axes
};

struct TagWindow {
  std::vector<Rigid3> T_w_body;  // by frame; the last one's origin is that of the window frame
  std::vector<CameraModel> cameras;
  std::vector<TagWindowEdge> edges;  // one fewer than frames
  double scale_sigma = 0;            // of all lengths of the odometry
  double tilt_variance = 0;          // of roll and of pitch, rad^2
};
// `frames`: at least one.
TagWindow MakeTagWindow(const KeyframeWindow& frames);

struct TagEstimate {
  Rigid3 T_m_c;
  std::vector<Rigid3> T_m_tag;
  std::vector<double> log_size;       // of metres, by tag
  std::array<double, 2> log_scale{};  // by window: a metre of the odometry is exp() metres
};

class TagProblem {
 public:
  // Mean and sigma of a tag's size.
  struct SizePrior {
    double log_size = 0;
    double sigma = 0;
  };
  TagProblem(std::array<TagWindow, 2> windows, std::vector<TagView> views,
             std::vector<SizePrior> sizes)
      : windows_(std::move(windows)), views_(std::move(views)), sizes_(std::move(sizes)) {}

  // Residuals in units of their sigmas; those of the corners are pixels: Solve whitens them.
  // `jacobian` may be null. Columns: T_m_c (6), T_m_tag (6 each), log sizes, log scales. Nothing if
  // a corner lies behind a camera.
  std::optional<Eigen::VectorXd> Residuals(const TagEstimate& at, Eigen::MatrixXd* jacobian) const;

  struct Solution {
    TagEstimate estimate;
    double chi2 = 0;
    int degrees_of_freedom = 0;
    double rms_px = 0;
    Eigen::MatrixXd covariance;  // of the columns above
  };
  // Nothing if it does not converge. `coarse`: without the errors of the odometry, and without a
  // covariance, to compare starts.
  std::optional<Solution> Solve(TagEstimate start, bool coarse) const;

  int num_columns() const { return 8 + 7 * static_cast<int>(sizes_.size()); }
  const std::vector<TagView>& views() const { return views_; }
  const std::array<TagWindow, 2>& windows() const { return windows_; }
  TagEstimate Moved(const TagEstimate& from, const Eigen::VectorXd& step) const;

 private:
  struct CornerAt;
  std::optional<CornerAt> See(const TagEstimate& at, const TagView& view, int corner) const;
  // Of all corners, px^2: of their pixels, and of the odometry between the frames of a window.
  std::optional<Eigen::MatrixXd> Covariance(const TagEstimate& at) const;

  std::array<TagWindow, 2> windows_;
  std::vector<TagView> views_;
  std::vector<SizePrior> sizes_;
};

}  // namespace pangea
