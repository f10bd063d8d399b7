#include "sim/scene/wall_tags.h"

#include <opencv2/imgproc.hpp>

#include "tags/tag_pattern.h"

namespace pangea::sim {
namespace {

constexpr int kTexels = 16;  // of a cell's side
constexpr float kInset_m = 0.05f;
constexpr float kHalfThickness_m = 0.005f;
constexpr uint8_t kBlack = 15, kWhite = 235;

// The picture as somebody sees it who looks at the wall; `mirrored`: a face's u runs to the left.
// A face's v runs upwards.
cv::Mat Picture(const TagPattern& pattern, bool mirrored) {
  cv::Mat cells(pattern.cells, pattern.cells, CV_8U);
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      cells.at<uint8_t>(pattern.cells - 1 - row, mirrored ? pattern.cells - 1 - column : column) =
          pattern.IsWhite(row, column) ? kWhite : kBlack;
    }
  }
  cv::Mat picture;
  cv::resize(cells, picture, {}, kTexels, kTexels, cv::INTER_NEAREST);
  return picture;
}

// `axis`: 0 or 1, normal to the wall; `high`: the wall at the room's larger coordinate.
void Hang(int id, double size_m, int axis, bool high, const Eigen::Vector3f& at, Scene* scene) {
  const TagPattern pattern = PatternOf({TagFamily::k36h11, id});
  const float side = static_cast<float>(size_m) * static_cast<float>(pattern.cells) /
                     static_cast<float>(pattern.square_cells);
  // Looking along -x, +y is to the right; along -y, +x is to the left.
  const bool mirrored = (axis == 0) == high;
  const cv::Mat picture = Picture(pattern, mirrored);
  Primitive panel;
  panel.p_ref = at;
  panel.half.setConstant(0.5f * side);
  panel.half[axis] = kHalfThickness_m;
  panel.surfaces.fill(static_cast<int>(scene->surfaces.size()));
  Surface surface;
  surface.texture = Texture(picture, side / static_cast<float>(picture.cols), false);
  surface.detail_gain = 0;
  scene->surfaces.push_back(std::move(surface));
  scene->primitives.push_back(panel);
}

}  // namespace

void AddTags(const WallTags& tags, Scene* scene) {
  int id = tags.first_id;
  const auto step = static_cast<float>(tags.every_m);
  for (const int axis : {0, 1}) {
    const int along = 1 - axis;
    for (const bool high : {false, true}) {
      Eigen::Vector3f at;
      at[axis] = high ? scene->room_max[axis] - kInset_m : scene->room_min[axis] + kInset_m;
      at.z() = scene->room_min.z() + static_cast<float>(tags.height_m);
      for (at[along] = scene->room_min[along] + 0.5f * step; at[along] < scene->room_max[along];
           at[along] += step) {
        if (id < NumTagIds(TagFamily::k36h11)) {
          Hang(id++, tags.size_m, axis, high, at, scene);
        }
      }
    }
  }
}

}  // namespace pangea::sim
