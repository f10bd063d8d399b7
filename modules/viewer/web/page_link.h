#pragma once

// One page's end of the conversation, without its socket. A page is sent an update, says when it
// has taken it in, and is sent the next: never more than one is under way, so a slow browser falls
// behind in time, not in memory, and then sees the newest state.

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "viewer/scene/update.h"
#include "viewer/show.h"
#include "web/web_site.h"

namespace pangea::viewer {

class PageLink : public web::WebPeer {
 public:
  static constexpr double kMaxSpeed = 1000;

  explicit PageLink(Show& show) : show_(show) {}

  bool is_text() const override { return false; }
  // Nothing while the last one is under way or when there is no update.
  std::optional<std::vector<uint8_t>> Next() override;

  // {"taken": VERSION}, {"seek": SECONDS}, {"play": BOOL}, {"speed": FACTOR}, {"watch": AGENT};
  // where the show is editable also {"anchor_add": {"name": NAME, "keyframe": INDEX, "p_body": [X,
  // Y, Z]}},
  // {"anchor_move": {"anchor": [AGENT, CREATED], "keyframe": INDEX, "p_body": [X, Y, Z]}} and
  // {"anchor_delete": {"anchor": [AGENT, CREATED]}}.
  // False for anything else: no page of ours says it.
  bool Receive(std::string_view text) override;

 private:
  Show& show_;
  Seen seen_;
  bool under_way_ = false;
};

}  // namespace pangea::viewer
