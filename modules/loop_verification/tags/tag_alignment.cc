#include "loop_verification/tags/tag_alignment.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "loop_verification/tags/planar_pose.h"

namespace pangea {
namespace {

// Of a tag whose size is given: paper stretches, and people measure to the millimetre.
constexpr double kSizeSigma = 0.003;
// Of one whose size is not given: any, from a label to a poster.
constexpr double kUnknownSize_m = 0.15;
constexpr double kUnknownSizeSigma = 1;
// Sizes that are tried for it.
constexpr double kTriedSizes_m[] = {0.06, 0.15, 0.4};
constexpr size_t kMaxCommonTags = 3;

double AreaOf(const TagView& view) {
  const Eigen::Vector2d a = view.pixels[2] - view.pixels[0];
  const Eigen::Vector2d b = view.pixels[3] - view.pixels[1];
  return 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
}

// The views by tag; `window` as in TagView.
std::map<TagId, std::vector<TagView>> ViewsOf(const KeyframeWindow& frames, int window) {
  std::map<TagId, std::vector<TagView>> views;
  for (size_t i = 0; i < frames.size(); ++i) {
    for (const TagObservation& seen : frames[i]->keyframe().tags) {
      TagView view{window, static_cast<int>(i), 0, {}};
      for (size_t k = 0; k < seen.corners.size(); ++k) {
        view.pixels[k] = seen.corners[k].cast<double>();
      }
      views[seen.tag].push_back(view);
    }
  }
  return views;
}

struct CommonTag {
  TagId tag;
  TagView largest_m, largest_c;
  std::vector<TagView> views;  // of both windows
  double area() const { return std::sqrt(AreaOf(largest_m) * AreaOf(largest_c)); }
};

TagView LargestOf(const std::vector<TagView>& views) {
  return *std::ranges::max_element(views, {}, AreaOf);
}

// The largest in both windows first.
std::vector<CommonTag> CommonTags(const KeyframeWindow& m, const KeyframeWindow& c) {
  const auto of_m = ViewsOf(m, 0), of_c = ViewsOf(c, 1);
  std::vector<CommonTag> common;
  for (const auto& [tag, views_m] : of_m) {
    if (const auto views_c = of_c.find(tag); views_c != of_c.end()) {
      CommonTag one{tag, LargestOf(views_m), LargestOf(views_c->second), views_m};
      one.views.insert(one.views.end(), views_c->second.begin(), views_c->second.end());
      common.push_back(std::move(one));
    }
  }
  std::ranges::stable_sort(common, std::greater(), &CommonTag::area);
  common.resize(std::min(common.size(), kMaxCommonTags));
  return common;
}

// Both poses of the tag in the window of its view.
std::vector<Rigid3> PosesOf(const TagView& view, const TagWindow& window, double size_m) {
  const auto frame = static_cast<size_t>(view.frame);
  const CameraModel& camera = window.cameras[frame];
  std::array<Eigen::Vector2d, kTagCorners> rays;
  for (size_t k = 0; k < rays.size(); ++k) {
    const auto ray = camera.Unproject(view.pixels[k]);
    if (!ray) {
      return {};
    }
    rays[k] = *ray;
  }
  std::vector<Rigid3> poses = PosesOfSquare(rays);
  for (Rigid3& pose : poses) {
    pose.t *= 0.5 * size_m;
    pose = window.T_w_body[frame] * camera.T_body_cam * pose;
  }
  return poses;
}

class Alignment {
 public:
  Alignment(const std::vector<CommonTag>& tags, std::array<TagWindow, 2> windows,
            const TagSizes& sizes)
      : tags_(tags) {
    std::vector<TagView> views;
    std::vector<TagProblem::SizePrior> priors;
    for (size_t i = 0; i < tags.size(); ++i) {
      for (TagView view : tags[i].views) {
        view.tag = static_cast<int>(i);
        views.push_back(view);
      }
      const auto size = sizes.Of(tags[i].tag);
      sizes_.push_back(size);
      priors.push_back(
          {std::log(size.value_or(kUnknownSize_m)), size ? kSizeSigma : kUnknownSizeSigma});
    }
    problem_.emplace(std::move(windows), std::move(views), std::move(priors));
  }

  std::optional<TagAlignment> Solve() const {
    std::vector<TagProblem::Solution> coarse;
    for (const TagEstimate& start : Starts()) {
      if (auto solution = problem_->Solve(start, true)) {
        coarse.push_back(std::move(*solution));
      }
    }
    std::ranges::stable_sort(coarse, {}, &TagProblem::Solution::chi2);
    std::optional<TagProblem::Solution> best, rival;
    for (const TagProblem::Solution& start : DifferentOnes(coarse)) {
      auto solution = problem_->Solve(start.estimate, false);
      if (!solution) {
        continue;
      }
      if (!best || solution->chi2 < best->chi2) {
        std::swap(best, solution);
      }
      if (solution && IsDifferent(*solution, *best) && (!rival || solution->chi2 < rival->chi2)) {
        rival = std::move(solution);
      }
    }
    return best ? std::optional(ResultOf(*best, rival)) : std::nullopt;
  }

 private:
  static bool IsDifferent(const TagProblem::Solution& a, const TagProblem::Solution& b) {
    constexpr double kSame_m = 0.05, kSame_rad = 0.03;
    const Vector6d difference = a.estimate.T_m_c.Minus(b.estimate.T_m_c);
    return difference.head<3>().norm() > kSame_m || difference.tail<3>().norm() > kSame_rad;
  }

  // The best few of the coarse solutions that differ.
  static std::vector<TagProblem::Solution> DifferentOnes(
      const std::vector<TagProblem::Solution>& sorted) {
    constexpr size_t kMaxSolved = 4;
    std::vector<TagProblem::Solution> different;
    for (const TagProblem::Solution& one : sorted) {
      if (different.size() < kMaxSolved &&
          std::ranges::all_of(different, [&](const TagProblem::Solution& other) {
            return IsDifferent(one, other);
          })) {
        different.push_back(one);
      }
    }
    return different;
  }

  std::vector<TagEstimate> Starts() const {
    std::vector<TagEstimate> starts;
    const std::vector<double> tried =
        sizes_[0] ? std::vector<double>{*sizes_[0]}
                  : std::vector<double>(std::begin(kTriedSizes_m), std::end(kTriedSizes_m));
    for (const double size_m : tried) {
      for (const Rigid3& T_m_tag : PosesOf(tags_[0].largest_m, problem_->windows()[0], size_m)) {
        for (const Rigid3& T_c_tag : PosesOf(tags_[0].largest_c, problem_->windows()[1], size_m)) {
          if (auto start = StartAt(T_m_tag, T_c_tag, size_m)) {
            starts.push_back(std::move(*start));
          }
        }
      }
    }
    return starts;
  }

  std::optional<TagEstimate> StartAt(const Rigid3& T_m_tag, const Rigid3& T_c_tag,
                                     double size_m) const {
    TagEstimate start;
    const Rigid3 free = T_m_tag * T_c_tag.Inverse();
    const Eigen::Quaterniond upright = YawRotation(YawOf(free.q));
    // Both tags at the same place, whatever the tilt that is left out.
    start.T_m_c = {upright, T_m_tag.t - upright * T_c_tag.t};
    start.T_m_tag.push_back(T_m_tag);
    start.log_size.push_back(std::log(size_m));
    std::vector<std::vector<Rigid3>> others(tags_.size());
    for (size_t i = 1; i < tags_.size(); ++i) {
      const double size_i = sizes_[i].value_or(size_m);
      others[i] = PosesOf(tags_[i].largest_m, problem_->windows()[0], size_i);
      if (others[i].empty()) {
        return std::nullopt;
      }
      start.T_m_tag.push_back(others[i].front());
      start.log_size.push_back(std::log(size_i));
    }
    for (size_t i = 1; i < tags_.size(); ++i) {
      ChoosePose(others[i], i, &start);
    }
    return start;
  }

  // The pose of a further tag that fits best.
  void ChoosePose(const std::vector<Rigid3>& poses, size_t tag, TagEstimate* start) const {
    double least = INFINITY;
    TagEstimate tried = *start;
    for (const Rigid3& pose : poses) {
      tried.T_m_tag[tag] = pose;
      const auto r = problem_->Residuals(tried, nullptr);
      if (r && r->squaredNorm() < least) {
        least = r->squaredNorm();
        start->T_m_tag[tag] = pose;
      }
    }
  }

  TagAlignment ResultOf(const TagProblem::Solution& best,
                        const std::optional<TagProblem::Solution>& rival) const {
    const Eigen::Quaterniond q_m = problem_->windows()[0].T_w_body.back().q;
    const Eigen::Quaterniond q_c = problem_->windows()[1].T_w_body.back().q;
    TagAlignment result;
    result.T_m_c = best.estimate.T_m_c;
    result.T_Km_Kc = Rigid3(q_m, Eigen::Vector3d::Zero()).Inverse() * result.T_m_c *
                     Rigid3(q_c, Eigen::Vector3d::Zero());
    Matrix6d to_body = Matrix6d::Zero();
    to_body.topLeftCorner<3, 3>() = to_body.bottomRightCorner<3, 3>() =
        q_m.conjugate().toRotationMatrix();
    result.covariance = to_body * best.covariance.topLeftCorner<6, 6>() * to_body.transpose();
    result.num_corners = kTagCorners * static_cast<int>(problem_->views().size());
    result.rms_px = best.rms_px;
    result.chi2_per_dof = best.chi2 / std::max(1, best.degrees_of_freedom);
    if (rival) {
      result.chi2_to_rival = rival->chi2 - best.chi2;
    }
    return result;
  }

  const std::vector<CommonTag>& tags_;
  std::vector<std::optional<double>> sizes_;
  std::optional<TagProblem> problem_;
};

}  // namespace

std::optional<TagAlignment> AlignByTags(const KeyframeWindow& m, const KeyframeWindow& c,
                                        const TagSizes& sizes) {
  const std::vector<CommonTag> tags = CommonTags(m, c);
  if (tags.empty()) {
    return std::nullopt;
  }
  return Alignment(tags, {MakeTagWindow(m), MakeTagWindow(c)}, sizes).Solve();
}

}  // namespace pangea
