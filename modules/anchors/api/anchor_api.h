#pragma once

// The HTTP API of the anchors, for apps (openapi_anchors.json): answers requests. Uses no socket,
// bus or clock: the owner passes in requests, the time and the journal's edits, and publishes the
// edits that the API makes. Its edits are those of a tool on the server (agent 0).
//
// An edit is requested every second until the journal has it; only then is the client answered.
// After kTimeout_us it is answered that the outcome is unknown. At most kMaxPending edits are
// pending.

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "anchors/anchors.h"
#include "anchors/api/anchor_feed.h"
#include "anchors/api/edit_body.h"
#include "web/web_site.h"

namespace pangea {

class AnchorApi : public web::WebSite {
 public:
  static constexpr int64_t kRepeat_us = 1'000'000;
  static constexpr int64_t kTimeout_us = 5'000'000;
  static constexpr size_t kMaxPending = 100;

  using EditRequest = std::function<void(const AnchorEdit&)>;

  // `anchors` was made with `options`, and must outlive the API. `request`: publishes an edit to be
  // journalled.
  AnchorApi(const Anchors& anchors, const AnchorsOptions& options, EditRequest request)
      : anchors_(anchors),
        max_anchors_(static_cast<size_t>(options.max_anchors)),
        request_(std::move(request)),
        feed_(anchors) {}

  // Call often: handles repeats and timeouts. `complete`: the anchors of the whole journal are
  // known; until then requests for anchors are answered with status 503.
  void Tick(int64_t now_utime, bool complete);
  // Call for each edit of the journal. `refused`: why it was refused, or empty.
  void Take(const AnchorEdit& edit, const std::string& refused);

  void Answer(const web::WebRequest& request, Reply reply) override;
  std::unique_ptr<web::WebPeer> Open(const web::WebRequest& request) override;

 private:
  using Path = std::vector<std::string>;

  struct Pending {
    AnchorEdit edit;
    Reply reply;
    int64_t next_utime = 0;  // time of the next request
    int64_t timeout_utime = 0;
  };

  void AnswerAnchors(const web::WebRequest& request, const std::string& query, const Reply& reply);
  void AnswerAnchor(const web::WebRequest& request, const Path& path, const Reply& reply);
  void Make(const web::WebRequest& request, const Reply& reply);
  // Anchors that are requested, and not in the journal yet.
  size_t NumPendingNew() const;
  // Changes or deletes an existing anchor.
  void Change(const web::WebRequest& request, const ListedAnchor& anchor, const Reply& reply);
  web::WebAnswer List(const std::string& query) const;
  web::WebAnswer Agents() const;
  web::WebAnswer AnchorsOfAgent(const std::string& agent) const;

  // Fills in the placement of the anchor. The error is empty on success.
  BadField SetPose(const BodyPose& pose, AnchorEdit* edit) const;
  BadField SetPose(const PoseInGroup& pose, AnchorEdit* edit) const;
  BadField SetPose(const PoseByKeyframe& pose, AnchorEdit* edit) const;
  BadField SetPose(const PoseBehindPixel& pose, AnchorEdit* edit) const;
  AnchorId NewId();
  void Submit(AnchorEdit edit, const Reply& reply);
  web::WebAnswer Outcome(const AnchorEdit& ours, const AnchorEdit& journalled,
                         const std::string& refused) const;

  const Anchors& anchors_;
  const size_t max_anchors_;
  const EditRequest request_;
  AnchorFeed feed_;
  int64_t now_utime_ = 0;
  bool complete_ = false;
  int64_t newest_created_utime_ = 0;
  std::list<Pending> pending_;
  // Newest requested revisions that the journal may not have yet.
  std::map<AnchorId, int64_t> requested_;
};

}  // namespace pangea
