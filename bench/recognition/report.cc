#include "bench/recognition/report.h"

#include <fmt/format.h>

#include "eval/plot.h"

namespace pangea::bench {
namespace {

const std::vector<KeyframeId>& WithOverlap(const Outcome& outcome, Search search) {
  static const std::vector<KeyframeId> kNone;
  const auto found = outcome.with_overlap.find(search);
  return found == outcome.with_overlap.end() ? kNone : found->second;
}

Plot CurvesOf(const Outcome& outcome, Search search) {
  const std::vector<KeyframeId>& with_overlap = WithOverlap(outcome, search);
  Plot plot;
  plot.title =
      fmt::format("Places in {}: {} keyframes have one", ToString(search), with_overlap.size());
  plot.x_label = "recall";
  plot.y_label = "precision";
  for (size_t stage = 0; stage < kStages.size(); ++stage) {
    const std::vector<Scored> scored = AtStage(outcome, search, stage);
    PlotLine line{.label = kStages[stage], .colour = AgentColour(stage)};
    for (const PrecisionRecall& point : OverThresholds(scored, with_overlap)) {
      line.points.emplace_back(point.recall, point.precision);
    }
    const PrecisionRecall decided = AsDecided(scored, with_overlap);
    PlotLine dot{.colour = line.colour, .mark_start = true};
    dot.points.emplace_back(decided.recall, decided.precision);
    plot.lines.push_back(std::move(line));
    plot.lines.push_back(std::move(dot));
  }
  return plot;
}

}  // namespace

std::string Table(const Outcome& outcome) {
  std::string text = fmt::format(
      "{} keyframes.\n\n| places in | keyframes that have one | stage | pass | right | found | "
      "precision | recall |\n|---|---|---|---|---|---|---|---|\n",
      outcome.keyframes);
  for (const Search search : kSearches) {
    const std::vector<KeyframeId>& with_overlap = WithOverlap(outcome, search);
    for (size_t stage = 0; stage < kStages.size(); ++stage) {
      const PrecisionRecall decided = AsDecided(AtStage(outcome, search, stage), with_overlap);
      text += fmt::format("| {} | {} | {} | {} | {} | {} | {:.3f} | {:.3f} |\n", ToString(search),
                          with_overlap.size(), kStages[stage], decided.passed, decided.right,
                          decided.found, decided.precision, decided.recall);
    }
  }
  return text;
}

void WriteCurves(const Outcome& outcome, const std::filesystem::path& folder) {
  for (const Search search : kSearches) {
    if (!WithOverlap(outcome, search).empty()) {
      const char* name = search == Search::kOwnMap ? "own_map.png" : "other_maps.png";
      WritePng(CurvesOf(outcome, search), (folder / name).string());
    }
  }
}

std::string Csv(const Outcome& outcome) {
  std::string text =
      "query,match,overlap,score,epipolar_inliers,verified,published,pnp_inliers,landmarks,"
      "accepted,error_m,error_rad\n";
  for (const Retrieved& l : outcome.retrieved) {
    text += fmt::format("{},{},{:.3f},{:.4f},{},{:d},{:d},{},{},{:d},{:.3f},{:.4f}\n",
                        ToString(l.query), ToString(l.match), l.overlap, l.score,
                        l.epipolar_inliers, l.verified, l.published, l.pnp_inliers, l.landmarks,
                        l.accepted, l.error_m, l.error_rad);
  }
  return text;
}

}  // namespace pangea::bench
