#pragma once

// What is known of any phone before: standard deviations, and where the solver starts.

#include "calibration/calibrate.h"

namespace pangea::calibration {

constexpr double kSigmaGivenRotation = 0.1;  // rad
constexpr double kSigmaTimeOffset_s = 0.1;
constexpr double kSigmaCentre = 0.02;  // of the wider side
constexpr double kSigmaDistortion = 0.15;
constexpr double kSigmaReadout_s = 0.012;
// Of stamps of the exposure's begin it is 1/2, of its end -1/2, of an image later -3/2.
constexpr double kSigmaIntervalShare = 1;

// Without a focal length.
CameraModel NominalCamera(const Input& input, CameraModel::Kind lens);

// To begin with, where nothing is known but the image's size, in pixels.
CameraModel GuessedCamera(int width, int height);

Prior PriorOf(const Input& input, const Parameters& mean);

}  // namespace pangea::calibration
