#pragma once

// The server's end of the connection to one page, without the socket. The page gets an update,
// confirms it, and gets the next one. At most one update is under way, so a slow browser does not
// use more memory, but only gets the newest state later.

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
  // The next update. Nothing while the last one is not confirmed, or when there is nothing new.
  std::optional<std::vector<uint8_t>> Next() override;

  // Takes {"taken": VERSION}, {"seek": SECONDS}, {"play": BOOL}, {"speed": FACTOR}, {"watch":
  // AGENT}; and if the show is editable:
  // {"anchor_add": {"name": NAME, "keyframe": INDEX, "p_body": [X, Y, Z]}},
  // {"anchor_move": {"anchor": [AGENT, CREATED], "keyframe": INDEX, "p_body": [X, Y, Z]}},
  // {"anchor_delete": {"anchor": [AGENT, CREATED]}}.
  // False for anything else, which our pages never send.
  bool Receive(std::string_view text) override;

 private:
  Show& show_;
  Seen seen_;
  bool under_way_ = false;
};

}  // namespace pangea::viewer
