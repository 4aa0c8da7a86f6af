// Generated organized clouds with every oddity that the cross-check names. Deterministic.

#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Dense>

namespace generated
{
  constexpr float NaN = std::numeric_limits<float>::quiet_NaN ();
  constexpr float Infinity = std::numeric_limits<float>::infinity ();

  /** \brief Points of an organized cloud, without a point type. */
  struct Points
  {
    std::string name;
    int width;
    int height;
    std::vector<Eigen::Vector3f> points;

    Eigen::Vector3f &
    at (int x, int y)
    {
      return points[static_cast<std::size_t> (y) * width + x];
    }
  };

  /** \brief A small generator of pseudo-random numbers, the same on every platform. */
  class Random
  {
    public:
      explicit Random (std::uint32_t seed) : state_ (seed * 2654435761u + 1u) {}

      std::uint32_t
      next ()
      {
        state_ ^= state_ << 13;
        state_ ^= state_ >> 17;
        state_ ^= state_ << 5;
        return state_;
      }

      int
      below (int limit)
      {
        return static_cast<int> (next () % static_cast<std::uint32_t> (limit));
      }

      /** \brief In -1 .. 1. */
      float
      symmetric ()
      {
        return static_cast<float> (next ()) / 2147483648.0f - 1.0f;
      }

    private:
      std::uint32_t state_;
  };

  /** \brief A pinhole camera's view of a depth function of the pixel. */
  inline Points
  view (const std::string &name, int width, int height, const std::function<float (double, double)> &depth)
  {
    Points result {name, width, height, {}};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
      {
        const double ray_x = (x - width / 2.0 + 0.25) / 60.0, ray_y = (y - height / 2.0 + 0.25) / 60.0;
        const float z = depth (ray_x, ray_y);
        result.points.emplace_back (static_cast<float> (ray_x * z), static_cast<float> (ray_y * z), z);
      }
    return result;
  }

  /** \brief The plane n . p = d; NaN behind the camera and beyond 20 m. */
  inline std::function<float (double, double)>
  plane (const Eigen::Vector3d &normal, double distance)
  {
    return [=] (double x, double y)
    {
      const double z = distance / normal.dot (Eigen::Vector3d (x, y, 1.0));
      return z > 0.0 && z < 20.0 ? static_cast<float> (z) : NaN;
    };
  }

  /** \brief An uneven surface with noise and a step: windows of many sizes. */
  inline Points
  scene (const std::string &name, int width = 64, int height = 48, std::uint32_t seed = 1)
  {
    Random random (seed);
    return view (name, width, height, [&] (double x, double y)
    {
      const double base = 1.5 + 0.3 * x + 0.2 * std::sin (9.0 * y) + (x * x + y * y < 0.02 ? -0.4 : 0.0);
      return static_cast<float> (base + 0.002 * random.symmetric ());
    });
  }

  /** \brief A scene that has been changed pixel by pixel. */
  inline Points
  changed (const std::string &name, const std::function<void (Points &)> &change)
  {
    Points result = scene (name);
    change (result);
    return result;
  }

  inline std::vector<Points>
  planes ()
  {
    std::vector<Points> result;
    for (int tilt_x : {-75, -40, -10, 0, 25, 60})
      for (int tilt_y : {-60, -25, 0, 10, 40, 75})
      {
        const double a = tilt_x * M_PI / 180.0, b = tilt_y * M_PI / 180.0;
        const Eigen::Vector3d normal (std::sin (a), std::cos (a) * std::sin (b), std::cos (a) * std::cos (b));
        result.push_back (view ("plane " + std::to_string (tilt_x) + " " + std::to_string (tilt_y), 64, 48,
                                plane (normal, 1.0)));
      }
    return result;
  }

  inline std::vector<Points>
  surfaces ()
  {
    std::vector<Points> result;
    const auto step = [] (bool near_side) { return near_side ? 1.0f : 1.5f; };
    result.push_back (view ("step in columns", 64, 48, [&] (double x, double) { return step (x < 0.1); }));
    result.push_back (view ("step in rows", 64, 48, [&] (double, double y) { return step (y < 0.1); }));
    result.push_back (view ("diagonal step", 64, 48, [&] (double x, double y) { return step (x + y < 0.1); }));
    result.push_back (view ("narrow bars", 64, 48, [&] (double x, double) { return step (std::sin (40.0 * x) < 0.0); }));
    for (double radius : {0.2, 0.6})
      result.push_back (view (radius < 0.5 ? "small sphere" : "large sphere", 64, 48, [=] (double x, double y)
      {
        const Eigen::Vector3d ray (x, y, 1.0), center (0.0, 0.0, 1.5);
        const double b = ray.dot (center), a = ray.squaredNorm ();
        const double root = b * b - a * (center.squaredNorm () - radius * radius);
        return static_cast<float> (root >= 0.0 ? (b - std::sqrt (root)) / a : 2.5);
      }));
    result.push_back (scene ("noisy surface"));
    result.push_back (scene ("odd size", 53, 41));
    return result;
  }

  /** \brief Pixels made invalid in every coordinate, here called missing, or changed otherwise. */
  inline std::vector<Points>
  oddities ()
  {
    const Eigen::Vector3f missing (NaN, NaN, NaN);
    std::vector<Points> result;
    const auto add = [&] (const std::string &name, const std::function<void (Points &)> &change)
    { result.push_back (changed (name, change)); };
    const auto scattered = [&] (const std::string &name, std::uint32_t seed, int count,
                                const std::function<void (Eigen::Vector3f &)> &change)
    {
      add (name, [&] (Points &cloud)
      {
        Random random (seed);
        for (int i = 0; i < count; ++i)
          change (cloud.at (random.below (cloud.width), random.below (cloud.height)));
      });
    };
    const auto column = [&] (const std::string &name, int at)
    {
      add (name, [&] (Points &cloud)
      { for (int y = 0; y < cloud.height; ++y) cloud.at (at < 0 ? cloud.width + at : at, y) = missing; });
    };
    const auto row = [&] (const std::string &name, int at)
    {
      add (name, [&] (Points &cloud)
      { for (int x = 0; x < cloud.width; ++x) cloud.at (x, at < 0 ? cloud.height + at : at) = missing; });
    };

    scattered ("one missing", 7, 1, [&] (Eigen::Vector3f &p) { p = missing; });
    scattered ("some missing", 8, 30, [&] (Eigen::Vector3f &p) { p = missing; });
    scattered ("half missing", 9, 2000, [&] (Eigen::Vector3f &p) { p = missing; });
    add ("blocks missing", [&] (Points &cloud)
    {
      for (int y = 0; y < cloud.height; ++y)
        for (int x = 0; x < cloud.width; ++x)
          if (x / 9 % 3 == 1 && y / 7 % 3 == 1)
            cloud.at (x, y) = missing;
    });
    add ("all missing", [&] (Points &cloud) { for (auto &p : cloud.points) p = missing; });
    column ("first column missing", 0);
    column ("second column missing", 1);
    column ("inner column missing", 31);
    column ("last column but one missing", -2);
    column ("last column missing", -1);
    row ("first row missing", 0);
    row ("second row missing", 1);
    row ("inner row missing", 22);
    row ("last row but one missing", -2);
    row ("last row missing", -1);
    add ("border missing here and there", [&] (Points &cloud)
    {
      const int w = cloud.width, h = cloud.height;
      cloud.at (0, 0) = cloud.at (w - 1, h - 1) = cloud.at (w - 1, 0) = cloud.at (0, h - 1) = missing;
      cloud.at (w - 1, 20) = cloud.at (20, h - 1) = cloud.at (0, 30) = cloud.at (40, 0) = missing;
    });

    add ("last point missing", [&] (Points &cloud) { cloud.points.back () = missing; });
    add ("last point infinite", [] (Points &cloud) { cloud.points.back ().z () = Infinity; });
    add ("last point far", [] (Points &cloud) { cloud.points.back () *= 100.0f; });

    scattered ("x alone missing", 10, 40, [] (Eigen::Vector3f &p) { p.x () = NaN; });
    scattered ("y alone missing", 11, 40, [] (Eigen::Vector3f &p) { p.y () = NaN; });
    scattered ("z alone missing", 12, 40, [] (Eigen::Vector3f &p) { p.z () = NaN; });
    add ("x of a block missing", [&] (Points &cloud)
    { for (int y = 15; y < 35; ++y) for (int x = 20; x < 45; ++x) cloud.at (x, y).x () = NaN; });
    scattered ("z infinite", 13, 20, [] (Eigen::Vector3f &p) { p.z () = Infinity; });
    scattered ("z minus infinite", 14, 20, [] (Eigen::Vector3f &p) { p.z () = -Infinity; });
    scattered ("x infinite", 15, 20, [] (Eigen::Vector3f &p) { p.x () = Infinity; });
    scattered ("all infinite", 16, 20, [] (Eigen::Vector3f &p) { p.setConstant (Infinity); });

    scattered ("zeros scattered", 17, 40, [] (Eigen::Vector3f &p) { p.setZero (); });
    add ("zeros in a block", [&] (Points &cloud)
    { for (int y = 12; y < 36; ++y) for (int x = 20; x < 45; ++x) cloud.at (x, y).setZero (); });
    add ("all zeros", [&] (Points &cloud) { for (auto &p : cloud.points) p.setZero (); });
    add ("negative z", [&] (Points &cloud) { for (auto &p : cloud.points) p.z () = -p.z (); });
    add ("negative z, far", [&] (Points &cloud) { for (auto &p : cloud.points) p *= -20.0f; });
    add ("far", [&] (Points &cloud) { for (auto &p : cloud.points) p *= 20.0f; });
    add ("millimetres", [&] (Points &cloud) { for (auto &p : cloud.points) p *= 1000.0f; });
    const std::vector<Eigen::Vector3f> shifts {{100, 0, 0}, {0, -100, 0}, {0, 0, 100}, {100, 100, 0}, {-100, 100, 100}};
    for (const Eigen::Vector3f &shift : shifts)
      add ("shifted by " + std::to_string (static_cast<int> (shift.x ())) + " "
               + std::to_string (static_cast<int> (shift.y ())) + " " + std::to_string (static_cast<int> (shift.z ())),
           [&] (Points &cloud) { for (auto &p : cloud.points) p += shift; });
    return result;
  }

  inline std::vector<Points>
  sizes ()
  {
    std::vector<Points> result;
    for (int height : {2, 3, 4, 7, 16, 23, 37})
      for (int width : {1, 2, 3, 5, 8, 13, 24, 41})
        result.push_back (scene (std::to_string (width) + " x " + std::to_string (height), width, height, 3));
    return result;
  }
}
