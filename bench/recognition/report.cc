#include "bench/recognition/report.h"

#include <fmt/format.h>

#include "eval/plot.h"

namespace pangea::bench {
namespace {

const std::vector<KeyframeId>& WithOverlap(const Run& run, Search search) {
  static const std::vector<KeyframeId> kNone;
  const auto found = run.with_overlap.find(search);
  return found == run.with_overlap.end() ? kNone : found->second;
}

Plot CurvesOf(const Run& run, Search search) {
  const std::vector<KeyframeId>& with_overlap = WithOverlap(run, search);
  Plot plot;
  plot.title =
      fmt::format("Places in {}: {} keyframes have one", ToString(search), with_overlap.size());
  plot.x_label = "recall";
  plot.y_label = "precision";
  plot.y_from_zero = true;
  for (size_t stage = 0; stage < kStages.size(); ++stage) {
    const std::vector<Judged> judged = AtStage(run, search, stage);
    PlotLine line{.label = kStages[stage], .colour = AgentColour(stage)};
    for (const PrecisionRecall& point : OverThresholds(judged, with_overlap)) {
      line.points.emplace_back(point.recall, point.precision);
    }
    const PrecisionRecall decided = AsDecided(judged, with_overlap);
    PlotLine dot{.colour = line.colour, .mark_start = true};
    dot.points.emplace_back(decided.recall, decided.precision);
    plot.lines.push_back(std::move(line));
    plot.lines.push_back(std::move(dot));
  }
  return plot;
}

}  // namespace

std::string Table(const Run& run) {
  std::string text = fmt::format(
      "{} keyframes.\n\n| places in | keyframes that have one | stage | pass | right | found | "
      "precision | recall |\n|---|---|---|---|---|---|---|---|\n",
      run.keyframes);
  for (const Search search : kSearches) {
    const std::vector<KeyframeId>& with_overlap = WithOverlap(run, search);
    for (size_t stage = 0; stage < kStages.size(); ++stage) {
      const PrecisionRecall figures = AsDecided(AtStage(run, search, stage), with_overlap);
      text += fmt::format("| {} | {} | {} | {} | {} | {} | {:.3f} | {:.3f} |\n", ToString(search),
                          with_overlap.size(), kStages[stage], figures.passed, figures.right,
                          figures.found, figures.precision, figures.recall);
    }
  }
  return text;
}

void WriteCurves(const Run& run, const std::filesystem::path& folder) {
  for (const Search search : kSearches) {
    if (!WithOverlap(run, search).empty()) {
      const char* name = search == Search::kOwnMap ? "own_map.png" : "other_maps.png";
      WritePng(CurvesOf(run, search), (folder / name).string());
    }
  }
}

std::string Csv(const Run& run) {
  std::string text =
      "query,match,overlap,score,epipolar_inliers,verified,published,pnp_inliers,landmarks,"
      "accepted,right_pose\n";
  for (const Looked& l : run.looked) {
    text += fmt::format("{},{},{:.3f},{:.4f},{},{:d},{:d},{},{},{:d},{:d}\n", ToString(l.query),
                        ToString(l.match), l.overlap, l.score, l.epipolar_inliers, l.verified,
                        l.published, l.pnp_inliers, l.landmarks, l.accepted, l.right_pose);
  }
  return text;
}

}  // namespace pangea::bench
