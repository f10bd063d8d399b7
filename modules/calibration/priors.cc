#include "calibration/priors.h"

#include <algorithm>

namespace pangea::calibration {
namespace {

// rad: of a rotation found among the 24 axis-aligned ones
constexpr double kSigmaAxisAligned = 0.25;
constexpr double kSigmaGyroBias = 0.1;  // rad/s
constexpr double kSigmaLogFocal = 0.3;
constexpr double kSigmaGivenLogFocal = 0.1;  // if a field of view is given
constexpr double kSigmaDistortion = 0.15, kSigmaDistortionEquidistant = 0.03;
constexpr double kReadout_s = 0.015;
constexpr double kGuessedField = 1.13;  // rad

}  // namespace

CameraModel NominalCamera(const Input& input, CameraModel::Kind lens) {
  CameraModel camera;
  camera.kind = lens;
  camera.width = input.width;
  camera.height = input.height;
  camera.cx = 0.5 * (input.width - 1);
  camera.cy = 0.5 * (input.height - 1);
  camera.readout_s = kReadout_s;
  return camera;
}

CameraModel GuessedCamera(int width, int height) {
  Input input;
  input.width = width;
  input.height = height;
  CameraModel camera = NominalCamera(input, CameraModel::Kind::kRadtan);
  camera.fx = camera.fy = FocalOf(kGuessedField, camera);
  return camera;
}

Prior PriorOf(const Input& input, const Parameters& mean) {
  Prior prior;
  prior.mean = mean;
  prior.sigma.segment<3>(kRotation).setConstant(input.q_body_cam ? kSigmaGivenRotation
                                                                 : kSigmaAxisAligned);
  prior.sigma.segment<3>(kGyroBias).setConstant(kSigmaGyroBias);
  prior.sigma[kTimeOffset] = kSigmaTimeOffset_s;
  prior.sigma[kLogFocal] = input.field_of_view ? kSigmaGivenLogFocal : kSigmaLogFocal;
  prior.sigma.segment<2>(kCentre).setConstant(kSigmaCentre * std::max(input.width, input.height));
  prior.sigma.segment<2>(kDistortion)
      .setConstant(mean.camera.kind == CameraModel::Kind::kEquidistant ? kSigmaDistortionEquidistant
                                                                       : kSigmaDistortion);
  prior.sigma[kReadout] = kSigmaReadout_s;
  prior.sigma[kIntervalShare] = kSigmaIntervalShare;
  return prior;
}

}  // namespace pangea::calibration
