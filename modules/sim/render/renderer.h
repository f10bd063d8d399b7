#pragma once

// Ray casting of a scene through a camera model: the light at each pixel, before blur and noise.
// One ray per pixel with a band-limited texture look-up; five more rays if a neighbouring pixel
// sees another face. Objects are culled by tiles of pixels. Deterministic; const and thread-safe.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/camera_model.h"
#include "sim/scene/scene.h"

namespace pangea::sim {

struct RenderedView {
  cv::Mat grey;   // CV_32F, 0 .. 255
  cv::Mat range;  // CV_32F, metres along the ray
};

class Renderer {
 public:
  // Both must outlive the renderer.
  Renderer(const Scene& scene, const CameraModel& camera);

  // T_ref_cam: one pose for all rows (global shutter), or one per row.
  RenderedView Render(const std::vector<Rigid3>& T_ref_cam) const;

 private:
  static constexpr int kTile = 16;
  struct PixelRay {
    Eigen::Vector3f direction;  // unit, camera frame
    float angle = 0;            // width of the pixel, radians
    bool valid = false;         // the camera model has a ray for it
  };
  struct TileCone {
    Eigen::Vector3f axis;
    float half_angle = 0;
  };
  struct RowPose {
    Eigen::Matrix3f R_ref_cam;
    Eigen::Vector3f p_ref_cam;
  };
  struct Candidate {
    float nearest;  // no part of it is nearer than this
    int primitive;
  };
  struct FrameState;

  void MakeRays();
  void MakeTiles();
  const PixelRay& RayAt(int x, int y) const {
    return rays_[static_cast<size_t>(y) * static_cast<size_t>(camera_.width) +
                 static_cast<size_t>(x)];
  }
  void FindCandidates(int tile, FrameState* state) const;
  Hit CastPixel(const RowPose& pose, const Eigen::Vector3f& direction_cam,
                const std::vector<Candidate>& candidates) const;
  void RenderTile(int tile, FrameState* state) const;
  void SmoothEdges(int tile, FrameState* state) const;
  float ShadeAcross(int x, int y, const FrameState& state) const;

  const Scene& scene_;
  const CameraModel& camera_;
  std::vector<PixelRay> rays_;
  int tiles_across_ = 0;
  std::vector<TileCone> tiles_;
};

}  // namespace pangea::sim
