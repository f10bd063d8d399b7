#pragma once

// Detects and describes the corners of a keyframe: its tracked landmarks, blobs (blobs.h), and FAST
// corners spread over the image and a pyramid. Landmarks and FAST corners have the descriptor of a
// trained network (patch_network.h) of a patch turned upright by gravity, and so have blobs. Or,
// for maps of earlier versions, corners have OpenCV's ORB (Rublee et al., ICCV 2011: 256 bits,
// orientation from the intensity centroid) and blobs a descriptor of their own
// (blob_descriptor.h), also 256 bits, which is not similar to any of a corner.
//
// Keyframes are matched across viewpoints and distances, so a tracked landmark is described on the
// octaves on which it is a corner, not on the octave on which the tracker follows it.

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <optional>
#include <vector>

#include "core/camera_model.h"
#include "core/keyframe.h"
#include "vio/front_end/patch_network.h"
#include "vio/front_end/patch_sampler.h"
#include "vio/front_end/tracks.h"

namespace pangea::vio {

struct DescriberOptions {
  DescriptorKind descriptor = DescriptorKind::kPatchNetwork;
  int max_blobs = 240;  // at most, of a keyframe's kMaxCorners

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.AddChoice("descriptor", &descriptor,
                      {{"orb", DescriptorKind::kOrb}, {"network", DescriptorKind::kPatchNetwork}},
                      "of corners; orb to be recognised in maps made with it");
    archive.Add("max_blobs", &max_blobs, {0, kMaxCorners}, "",
                "of a keyframe's corners, beside landmarks");
  }
};

class Describer {
 public:
  Describer(const CameraModel& camera, const DescriberOptions& options);

  // Corners of the image: first those with a landmark_id, in the order of the frame; then the
  // others, blobs and FAST corners alternating. `down_cam`: the direction of gravity in the camera
  // frame; zero if not known, then the image is taken as upright.
  std::vector<Corner> Describe(const cv::Mat& image, const TrackedFrame& frame,
                               const Eigen::Vector3d& down_cam);

  DescriptorKind kind() const { return options_.descriptor; }

 private:
  struct Candidate {
    cv::Point2f level_pixel;  // on its octave
    int octave = 0;
    float response = 0;
    int32_t landmark_id = kNoLandmark;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // raw, full size
  };

  void BuildPyramid(const cv::Mat& image);
  std::vector<Candidate> FindCorners(int octave, int wanted) const;
  std::vector<Candidate> FindCorners(int wanted) const;
  std::vector<Candidate> PlaceLandmarks(const TrackedFrame& frame) const;
  std::vector<cv::KeyPoint> WeakCorners(int octave, const cv::Rect& part) const;
  static float StrongestNear(const std::vector<cv::KeyPoint>& corners,
                             const cv::Point2f& level_pixel, cv::Point2f* at);
  std::optional<Candidate> Place(const Eigen::Vector2f& pixel, bool weak_too) const;
  cv::Point2f ToLevel(int octave, const Eigen::Vector2f& pixel) const;
  Eigen::Vector2f ToImage(int octave, const cv::Point2f& level_pixel) const;
  float Angle(int octave, const cv::Point2f& level_pixel) const;
  Corner ToCorner(const Candidate& candidate) const;
  std::vector<Corner> ComputeOrb(const std::vector<Candidate>& candidates) const;
  // `step_px`: width of the patch's pixels, in pixels of the image.
  PatchNetwork::Patch PatchAt(const Eigen::Vector2f& pixel, double step_px,
                              const PatchSampler& sampler) const;
  // Both return the descriptions in the order of what is described.
  std::vector<Corner> DescribeCorners(const std::vector<Candidate>& candidates,
                                      const Eigen::Vector3d& down_cam) const;
  std::vector<Corner> DescribeBlobs(const cv::Mat& image, int wanted,
                                    const Eigen::Vector3d& down_cam) const;

  CameraModel camera_;
  DescriberOptions options_;
  std::vector<double> scales_;                     // nominal scale of each octave with corners
  std::vector<cv::Mat> pyramid_;                   // has some coarser octaves too, for patches
  std::vector<std::vector<cv::KeyPoint>> strong_;  // corners of each octave, row by row
  cv::Ptr<cv::ORB> orb_;
};

}  // namespace pangea::vio
