#pragma once

// Priors for any phone: standard deviations, and initial values for the solver.

#include "calibration/calibrate.h"

namespace pangea::calibration {

constexpr double kSigmaGivenRotation = 0.1;  // rad
constexpr double kSigmaTimeOffset_s = 0.1;
constexpr double kSigmaCentre = 0.02;  // relative to the wider side
constexpr double kSigmaReadout_s = 0.012;
// interval_share is 1/2 if stamps are of the start of the exposure, -1/2 for its end, -3/2 for one
// image later.
constexpr double kSigmaIntervalShare = 1;

// Leaves the focal length open.
CameraModel NominalCamera(const Input& input, CameraModel::Kind lens);

// Initial camera if only the image size (pixels) is known.
CameraModel GuessedCamera(int width, int height);

Prior PriorOf(const Input& input, const Parameters& mean);

}  // namespace pangea::calibration
