#include "calibration/frame_pairs.h"

#include <algorithm>
#include <unordered_map>

#include "core/median.h"
#include "vio/window/image_stamps.h"

namespace pangea::calibration {
namespace {

constexpr double kEnoughMotion_px = 60;  // median
constexpr int kMinPoints = 25;
constexpr int kMaxPoints = 50;     // per pair, evenly chosen
constexpr double kMinShare = 0.4;  // smallest share of common points

std::vector<PointPair> Common(const vio::TrackedFrame& a, const vio::TrackedFrame& b) {
  std::unordered_map<int32_t, Eigen::Vector2d> in_a;
  for (const vio::Observation& o : a.observations) {
    in_a[o.landmark_id] = o.pixel.cast<double>();
  }
  std::vector<PointPair> points;
  for (const vio::Observation& o : b.observations) {
    const auto found = in_a.find(o.landmark_id);
    if (found != in_a.end()) {
      points.push_back({found->second, o.pixel.cast<double>()});
    }
  }
  return points;
}

// Excess of the interval over the usual one at each image; 0 within the jitter.
std::vector<double> ExcessIntervals(const std::vector<vio::TrackedFrame>& frames) {
  vio::ImageStamps stamps{CameraModel{}};
  std::vector<double> excess_s;
  for (const vio::TrackedFrame& frame : frames) {
    stamps.AddImage(frame.utime);
    if (!stamps.has_reference()) {
      stamps.SetReference();
    }
    excess_s.push_back(stamps.excess_interval_s());
  }
  const double usual_s = excess_s.empty() ? 0 : Median(excess_s);
  for (double& excess : excess_s) {
    excess -= usual_s;
  }
  return excess_s;
}

double MedianMotion(const std::vector<PointPair>& points) {
  std::vector<double> motion;
  for (const PointPair& point : points) {
    motion.push_back((point.b - point.a).norm());
  }
  return Median(std::move(motion));
}

}  // namespace

void Thin(int max_points, FramePair* pair) {
  std::vector<PointPair> some;
  const double every = std::max(1.0, static_cast<double>(pair->points.size()) / max_points);
  for (double i = 0; i < static_cast<double>(pair->points.size()); i += every) {
    some.push_back(pair->points[static_cast<size_t>(i)]);
  }
  pair->points = std::move(some);
}

std::vector<FramePair> MakePairs(const std::vector<vio::TrackedFrame>& frames, int64_t origin_utime,
                                 double max_gap_s) {
  const auto seconds = [origin_utime](const vio::TrackedFrame& frame) {
    return 1e-6 * static_cast<double>(frame.utime - origin_utime);
  };
  const std::vector<double> excess_s = ExcessIntervals(frames);
  std::vector<FramePair> pairs;
  double next_s = -1e9;
  for (size_t i = 0; i < frames.size(); ++i) {
    const double a_s = seconds(frames[i]);
    if (a_s < next_s) {
      continue;
    }
    FramePair pair;
    for (size_t j = i + 1; j < frames.size() && seconds(frames[j]) - a_s <= max_gap_s; ++j) {
      std::vector<PointPair> points = Common(frames[i], frames[j]);
      const auto enough = std::max<size_t>(
          static_cast<size_t>(kMinPoints),
          static_cast<size_t>(kMinShare * static_cast<double>(frames[i].observations.size())));
      if (points.size() < enough) {
        break;
      }
      pair = {a_s, seconds(frames[j]), excess_s[i], excess_s[j], std::move(points)};
      if (MedianMotion(pair.points) > kEnoughMotion_px) {
        break;
      }
    }
    if (!pair.points.empty()) {
      Thin(kMaxPoints, &pair);
      pairs.push_back(std::move(pair));
      next_s = a_s + kPairStep_s;
    }
  }
  return pairs;
}

}  // namespace pangea::calibration
