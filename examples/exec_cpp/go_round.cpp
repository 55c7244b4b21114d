// A planner in C++: the shortest way on a grid round everything that it has sensed.
//
//   c++ -O2 -std=c++17 -o go_round go_round.cpp
//   beacon-mj eval --planner exec:./go_round --family sparse
//
// Requests come as lines of JSON on stdin, answers go to stdout; docs/exec.md has the
// protocol. Cost-to-go is found by Dijkstra's search from the goal, anew whenever the map
// changes; the robot drives at the furthest cell of its way that it can drive to straight.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <limits>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "json.hpp"

constexpr double kCell = 0.05;                 // Edge of a cell [m].
constexpr double kMargins[] = {0.06, 0.02};    // Room to keep, if there is that much [m].
constexpr double kFar = std::numeric_limits<double>::infinity();

struct Point {
  double x, y;
};

double distance(Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y); }

Point point(const json::Value& pair) { return {pair[0].number, pair[1].number}; }

// A convex core, counter-clockwise, and the radius by which it is rounded.
struct Outline {
  std::vector<Point> core;
  double radius;

  // Distance from a point [m]; zero or less within.
  double gap(Point p) const {
    double nearest = kFar;
    bool inside = core.size() > 2;
    for (size_t i = 0; i < core.size(); ++i) {
      const Point a = core[i], b = core[(i + 1) % core.size()];
      const double ex = b.x - a.x, ey = b.y - a.y, square = ex * ex + ey * ey;
      double t = square > 0 ? ((p.x - a.x) * ex + (p.y - a.y) * ey) / square : 0.0;
      t = std::min(1.0, std::max(0.0, t));
      nearest = std::min(nearest, distance(p, {a.x + t * ex, a.y + t * ey}));
      inside = inside && ex * (p.y - a.y) - ey * (p.x - a.x) > 0;
    }
    return (inside ? -nearest : nearest) - radius;
  }
};

// Cost-to-go from every cell, for the robot's disc.
class Grid {
 public:
  Grid(const json::Value& workspace, double radius) : radius_(radius) {
    west_ = workspace[0].number, south_ = workspace[1].number;
    east_ = workspace[2].number, north_ = workspace[3].number;
    columns_ = std::max(1, static_cast<int>((east_ - west_) / kCell));
    rows_ = std::max(1, static_cast<int>((north_ - south_) / kCell));
  }

  void search(const std::vector<Outline>& outlines, Point goal, double margin) {
    free_.assign(cells(), 0);
    for (int c = 0; c < cells(); ++c) free_[c] = clearance(outlines, centre(c)) > margin;
    cost_.assign(cells(), kFar);
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open;
    const int end = cell(goal);
    free_[end] = 1;  // The goal is where it is.
    open.push({cost_[end] = 0.0, end});
    while (!open.empty()) {
      const auto [cost, c] = open.top();
      open.pop();
      if (cost > cost_[c]) continue;
      for (const auto& [n, length] : neighbours(c)) {
        if (free_[n] && cost + length < cost_[n]) open.push({cost_[n] = cost + length, n});
      }
    }
  }

  // Returns the cell to begin at: the robot's, or else the nearest with a way.
  int begin(Point p) const {
    int best = cell(p);
    if (cost_[best] < kFar) return best;
    double nearest = 0.4;
    best = -1;
    for (int c = 0; c < cells(); ++c) {
      if (cost_[c] < kFar && distance(centre(c), p) < nearest)
        nearest = distance(centre(c), p), best = c;
    }
    return best;
  }

  // Returns the furthest point of the way that can be driven to straight.
  Point ahead(Point p, int c, Point goal) const {
    Point found = centre(c);
    while (cost_[c] > 0.0) {
      c = downhill(c);
      if (!straight(p, centre(c))) return found;
      found = centre(c);
    }
    return goal;
  }

 private:
  int cells() const { return columns_ * rows_; }
  Point centre(int c) const {
    return {west_ + (c % columns_ + 0.5) * kCell, south_ + (c / columns_ + 0.5) * kCell};
  }
  int cell(Point p) const {
    const int i = static_cast<int>((p.x - west_) / kCell);
    const int j = static_cast<int>((p.y - south_) / kCell);
    return std::clamp(j, 0, rows_ - 1) * columns_ + std::clamp(i, 0, columns_ - 1);
  }

  double clearance(const std::vector<Outline>& outlines, Point p) const {
    double gap = std::min({p.x - west_, east_ - p.x, p.y - south_, north_ - p.y});
    for (const Outline& each : outlines) gap = std::min(gap, each.gap(p));
    return gap - radius_;
  }

  std::vector<std::pair<int, double>> neighbours(int c) const {
    std::vector<std::pair<int, double>> found;
    const int i = c % columns_, j = c / columns_;
    for (int di = -1; di <= 1; ++di)
      for (int dj = -1; dj <= 1; ++dj) {
        const bool within = i + di >= 0 && i + di < columns_ && j + dj >= 0 && j + dj < rows_;
        if (within && (di || dj))
          found.push_back({c + dj * columns_ + di, kCell * std::hypot(di, dj)});
      }
    return found;
  }

  int downhill(int c) const {
    int best = c;
    double least = kFar;
    for (const auto& [n, length] : neighbours(c))
      if (cost_[n] + length < least) least = cost_[n] + length, best = n;
    return best;
  }

  bool straight(Point a, Point b) const {
    const int steps = static_cast<int>(distance(a, b) / (0.4 * kCell)) + 1;
    for (int k = 1; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      if (!free_[cell({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)})]) return false;
    }
    return true;
  }

  double radius_, west_, south_, east_, north_;
  int columns_, rows_;
  std::vector<char> free_;
  std::vector<double> cost_;
};

// The planner of one episode.
class GoRound {
 public:
  explicit GoRound(const json::Value& task)
      : grid_(task["workspace_m"], task["radius_m"].number),
        goal_(point(task["goal_m"])),
        speed_(task["speed_mps"].number),
        period_(task["control_period_s"].number) {}

  // Returns the velocity [m/s]; sets `stuck` where there is no way.
  Point decide(const json::Value& seen, bool& stuck) {
    const Point here = point(seen["position_m"]);
    const double version = seen["map_version"].number;
    if (version != version_) {
      version_ = version, outlines_ = outlines(seen["obstacles"]);
      grid_.search(outlines_, goal_, margin_ = kMargins[0]);
    }
    int begin = grid_.begin(here);
    if (begin < 0 && margin_ != kMargins[1]) {
      grid_.search(outlines_, goal_, margin_ = kMargins[1]);
      begin = grid_.begin(here);
    }
    stuck = begin < 0;
    if (stuck) return {0.0, 0.0};
    const Point target = grid_.ahead(here, begin, goal_);
    const double away = std::max(distance(here, target), 1e-9);
    const double pace = std::min(speed_, away / period_);
    return {pace * (target.x - here.x) / away, pace * (target.y - here.y) / away};
  }

 private:
  static std::vector<Outline> outlines(const json::Value& obstacles) {
    std::vector<Outline> found;
    for (const json::Value& obstacle : obstacles.items) {
      const json::Value& footprint = obstacle["footprint"];
      Outline outline{{}, footprint["radius"].number};
      for (const json::Value& vertex : footprint["vertices"].items)
        outline.core.push_back(point(vertex));
      found.push_back(outline);
    }
    return found;
  }

  Grid grid_;
  Point goal_;
  double speed_, period_, version_ = -1.0, margin_ = 0.0;
  std::vector<Outline> outlines_;
};

int main() {
  std::vector<GoRound> planner;  // None, or that of the episode.
  for (std::string line; std::getline(std::cin, line);) {
    const json::Value message = json::Reader(line).read();
    const std::string& type = message["type"].text;
    const long id = static_cast<long>(message["id"].number);
    if (type == "hello") {
      std::printf("{\"type\":\"hello\",\"id\":%ld,\"protocol\":1}\n", id);
    } else if (type == "act" && !planner.empty()) {
      bool stuck = false;
      const Point v = planner[0].decide(message["observation"], stuck);
      std::printf("{\"type\":\"command\",\"id\":%ld,\"velocity_mps\":[%.17g,%.17g],"
                  "\"give_up\":%s}\n", id, v.x, v.y, stuck ? "true" : "false");
    } else if (type == "reset" || type == "next_day") {
      planner.assign(1, GoRound(message["task"]));
      std::printf("{\"type\":\"ready\",\"id\":%ld}\n", id);
    } else {
      std::printf("{\"type\":\"error\",\"id\":%ld,\"text\":\"what is %s?\"}\n", id,
                  type.c_str());
    }
    std::fflush(stdout);
  }
}
