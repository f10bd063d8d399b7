#pragma once

// Anchors in the images of those who see them.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea::session {

inline constexpr const char* kAnchorPicture = "anchors.jpg";
inline constexpr size_t kMaxAnchorPictures = 4;
inline constexpr const char* kAnchorPictureExplained =
    "Left: where the agent placed it. Right: another agent's image. The cube stands where the "
    "agent "
    "shows the anchor, the circle is where ground truth has it.";

// A row for each of the first kMaxAnchorPictures anchors that two agents have in an image: the
// maker's at the placing, and that of the other agent in whose image it is furthest inside. JPEG;
// empty where no anchor or no recording is at hand. What cannot be read is added to `notes`.
std::string AnchorsJpeg(const CapturedSession& session, const ReportMetrics& metrics,
                        std::vector<std::string>* notes);

}  // namespace pangea::session
