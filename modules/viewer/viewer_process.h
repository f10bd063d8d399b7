#pragma once

// Shows a live bus. In: all messages that are shown. Out: STATUS_viewer, and requests: a viewer
// that starts late asks for the keyframes and verification results that it missed, as any process
// does.
//
// Changes of anchors by people are published on ANCHOR_REQUEST_0, each edit once per second until
// ANCHOR_EDIT shows that it is in the journal. The pages are told if another edit has overridden
// it, and if it is not there after 20 s.
//
// An edit names one keyframe, but the server lets several hold the anchor, which the optimised map
// has a little elsewhere than their odometry. So the viewer tries what the server will do, and
// corrects the edit.

#include <set>
#include <string>

#include "anchors/anchors.h"
#include "bus/bus.h"
#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/missing.h"
#include "messages/catch_up_messages.h"
#include "viewer/anchor_requests.h"
#include "viewer/scene/scene_events.h"
#include "viewer/show.h"

namespace pangea::viewer {

class ViewerProcess : public Process, public Show {
 public:
  enum class Pages : uint8_t { kEdit, kLook };

  ViewerProcess(Bus& bus, std::string source, int64_t start_utime, Pages pages = Pages::kEdit);

  // Also shows the images on an agent's own bus, which are not sent to the server.
  void WatchAgent(Bus& agent_bus);

  void Tick(int64_t now_utime) override;

  const Scene& scene() const override { return scene_; }
  int64_t epoch() const override { return 1; }
  ShowClock clock() const override { return clock_; }
  std::string source() const override { return source_; }
  bool editable() const override { return pages_ == Pages::kEdit; }
  void Change(const AnchorChange& change) override;

 private:
  void OnMessage(const std::string& channel, Bytes data);
  void NoteForAnchors(SceneEvents::Outcome* outcome);
  void OnHave(const Have& have);
  void AskForMissing(int64_t now_utime);
  void OnAnchorEdit(const AnchorEdit& edit);
  int64_t NewAnchorUtime();
  void PublishRequests();

  Node node_;
  std::string source_;
  int64_t start_utime_;
  const Pages pages_;
  int64_t now_utime_;  // time of the last tick
  Scene scene_;
  SceneEvents events_;
  ShowClock clock_;
  MissingMessages keyframes_;
  std::set<MapId> results_requested_;  // maps whose earlier verification results were asked for
  AnchorRequests requests_;
  Anchors anchors_{AnchorsOptions()};  // has the keyframes that can hold anchors, but no anchors
  int64_t newest_anchor_utime_ = 0;
};

}  // namespace pangea::viewer
