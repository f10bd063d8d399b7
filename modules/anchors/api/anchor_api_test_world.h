#pragma once

// The API without socket and bus; the test plays the journal.

#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "anchors/anchors_test_world.h"
#include "anchors/api/anchor_api.h"

namespace pangea {

struct Heard {
  int status = 0;  // 0: no answer yet
  nlohmann::json body;
  std::map<std::string, std::string> headers;
};

class AnchorApiTest : public AnchorsTestWorld {
 protected:
  AnchorApiTest()
      : AnchorsTestWorld(true), api_(anchors_, AnchorsOptions(), [this](const AnchorEdit& edit) {
          requested_.push_back(edit);
        }) {
    Pass(0);
  }

  void Pass(int64_t us) { api_.Tick(now_utime_ += us, complete_); }

  std::shared_ptr<Heard> Ask(const std::string& method, const std::string& target,
                             const std::string& body = "", const std::string& if_match = "") {
    auto heard = std::make_shared<Heard>();
    api_.Answer({method, target, "localhost", if_match, body}, [heard](web::WebAnswer answer) {
      EXPECT_EQ(heard->status, 0) << "answered twice";
      heard->status = answer.status;
      heard->headers.insert(answer.headers.begin(), answer.headers.end());
      heard->body = answer.body.empty() ? nlohmann::json() : nlohmann::json::parse(answer.body);
    });
    return heard;
  }
  Heard Get(const std::string& target) { return *Ask("GET", target); }

  // Journals an edit as agent_handler and AnchorsProcess do.
  void Journal(AnchorEdit edit) {
    edit.seq = next_seq_++;
    if (edit.agent_id == 0) {
      edit.right = AnchorRight::kEditAll;
    }
    const std::string refused = anchors_.Take(edit);
    api_.Take(edit, refused);
  }
  void JournalNewest() { Journal(requested_.back()); }

  std::string NewBody(int agent, const Eigen::Vector3d& p) const {
    return fmt::format(
        R"({{"name": "kettle", "payload": "hot", "pose": {{"group": "{}", "position": [{}, {}, {}]}}}})",
        ToString(map(agent)), p.x(), p.y(), p.z());
  }
  // Makes and journals an anchor near agent 1.
  nlohmann::json Make() {
    const auto heard = Ask("POST", "/v1/anchors", NewBody(0, NearAgent()));
    JournalNewest();
    EXPECT_EQ(heard->status, 201) << heard->body;
    return heard->body;
  }
  Eigen::Vector3d NearAgent() const {
    return world_.agents[0].keyframes[15].T_odom_body * Eigen::Vector3d(1.5, 0.3, 0);
  }
  static Eigen::Vector3d PositionOf(const nlohmann::json& anchor) {
    const nlohmann::json& p = anchor.at("pose").at("position");
    return {p[0].get<double>(), p[1].get<double>(), p[2].get<double>()};
  }

  AnchorApi api_;
  std::vector<AnchorEdit> requested_;
  bool complete_ = true;
  int64_t now_utime_ = 1'700'000'000'000'000;
  int64_t next_seq_ = 0;
};

}  // namespace pangea
