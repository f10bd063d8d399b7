#pragma once

// What changes, for those who listen on a WebSocket. Each anchor has one newest state here, so a
// slow listener is sent that and never a queue. Bounded by the number of anchors.
//
// The clock is set by the owner; anchors are looked at every kInterval_us, and only while somebody
// listens.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "anchors/anchors.h"
#include "anchors/api/anchor_json.h"
#include "web/web_site.h"

namespace pangea {

class AnchorFeed {
 public:
  static constexpr int64_t kInterval_us = 200'000;

  // `anchors` outlives it.
  explicit AnchorFeed(const Anchors& anchors) : anchors_(anchors) {}

  void SetNow(int64_t now_utime) { now_utime_ = now_utime; }

  // The first change after version `seen`; anchors that were gone at `since` already are left out.
  struct Change {
    int64_t version = 0;
    std::string json;
  };
  std::optional<Change> After(int64_t seen, int64_t since);
  int64_t version() const { return version_; }

 private:
  struct Entry {
    int64_t version = 0;
    std::optional<ListedAnchor> newest;  // nothing: gone
  };

  void Refresh();
  static bool IsOther(const ListedAnchor& a, const ListedAnchor& b);
  void Set(const AnchorId& id, std::optional<ListedAnchor> newest);

  const Anchors& anchors_;
  int64_t now_utime_ = 0;
  int64_t next_utime_ = 0;
  int64_t version_ = 0;
  std::map<AnchorId, Entry> entries_;
  std::map<int64_t, AnchorId> by_version_;  // of each anchor the newest
};

// One listener: all anchors first, then what changes.
class AnchorListener : public web::WebPeer {
 public:
  explicit AnchorListener(AnchorFeed& feed) : feed_(feed), since_(feed.version()) {}

  bool is_text() const override { return true; }
  std::optional<std::vector<uint8_t>> Next() override;
  // There is nothing to say to it.
  bool Receive(std::string_view) override { return false; }

 private:
  AnchorFeed& feed_;
  const int64_t since_;
  int64_t seen_ = 0;
};

}  // namespace pangea
