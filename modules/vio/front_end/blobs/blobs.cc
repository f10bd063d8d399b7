#include "vio/front_end/blobs/blobs.h"

#include <algorithm>
#include <cmath>

#include "vio/front_end/blobs/blob_descriptor.h"
#include "vio/front_end/blobs/scale_space.h"
#include "vio/front_end/spread.h"

namespace pangea::vio {
namespace {

constexpr int kMaxOctave = 15;
// Blobs of this diameter are located as precisely as corners on octave 0.
constexpr double kSureDiameter_px = 8;

int OctaveOf(double diameter_px) {
  const double octave = std::log(diameter_px / kSureDiameter_px) / std::log(kOctaveScale);
  return std::clamp(static_cast<int>(std::lround(octave)), 0, kMaxOctave);
}

Corner ToCorner(const Blob& blob) {
  Corner corner;
  corner.pixel = {blob.pixel.x, blob.pixel.y};
  corner.octave = static_cast<int8_t>(OctaveOf(2 * blob.sigma_px));
  return corner;
}

}  // namespace

std::vector<FoundBlob> FindBlobs(const cv::Mat& image, int wanted, int cell_px) {
  std::vector<FoundBlob> found;
  if (wanted <= 0) {
    return found;
  }
  const ScaleSpace space(image);
  for (const Blob& blob :
       SpreadOver(space.blobs(), &Blob::pixel, cell_px, image.cols, static_cast<size_t>(wanted))) {
    found.push_back({ToCorner(blob), blob.sigma_px});
  }
  return found;
}

std::vector<Corner> DescribeBlobs(const cv::Mat& image, int wanted, int cell_px) {
  std::vector<Corner> corners;
  if (wanted <= 0) {
    return corners;
  }
  const ScaleSpace space(image);
  for (const Blob& blob :
       SpreadOver(space.blobs(), &Blob::pixel, cell_px, image.cols, static_cast<size_t>(wanted))) {
    for (const Descriptor& descriptor : DescribeBlob(space, blob)) {
      Corner corner = ToCorner(blob);
      corner.descriptor = descriptor;
      corners.push_back(corner);
    }
  }
  corners.resize(std::min(corners.size(), static_cast<size_t>(wanted)));
  return corners;
}

}  // namespace pangea::vio
