"""Hold the robot as arrays, and place its spheres by compiled forward kinematics."""

from typing import NamedTuple

import numpy as np
from numba import njit

from torc.robots.kinematics import forward


class RobotArrays(NamedTuple):
    """The robot. Spheres are sorted by link; link_start[l]..link_start[l + 1] are link l's.

    Links 0..dof-1 are the arm's, dof the gripper's body (frame tool0), dof + 1 and dof + 2 its fingers (TCP
    frame, shifted by half the opening along x), dof + 3 whatever is attached (tool0). tcps holds the TCP in
    the tool0 frame at openings from 0 in equal steps of tcp_step_m.
    """

    base: np.ndarray
    parents: np.ndarray
    axes: np.ndarray
    tool: np.ndarray
    tcps: np.ndarray
    tcp_step_m: float
    link_start: np.ndarray
    centers: np.ndarray
    radii: np.ndarray
    link_spheres: np.ndarray
    static_spheres: np.ndarray
    static_links: np.ndarray
    self_pairs: np.ndarray


@njit(cache=True)
def _tool0_from_finger(robot, width_m, point, shift, out):
    """Write a finger's point (TCP frame, opening 0) in the tool0 frame at an opening."""
    s = min(max(width_m / robot.tcp_step_m, 0.0), robot.tcps.shape[0] - 1.0)
    k = min(int(s), robot.tcps.shape[0] - 2)
    s -= k
    x, y, z = point[0] + shift, point[1], point[2]
    for i in range(3):
        low, high = robot.tcps[k, i], robot.tcps[k + 1, i]
        a = low[0] * x + low[1] * y + low[2] * z + low[3]
        b = high[0] * x + high[1] * y + high[2] * z + high[3]
        out[i] = a + s * (b - a)


@njit(cache=True)
def place_spheres(q, width_m, robot, scratch):
    """Write world centres of the robot's spheres at q, then those of the spheres around each link, to scratch[3]."""
    dof = q.shape[0]
    _, Ts, poses, out = scratch
    forward(q, robot, Ts, poses)
    local = poses[0, 0]
    links, n = robot.link_start.shape[0] - 1, robot.radii.shape[0]
    for link in range(links):
        T = Ts[min(link, dof)]
        finger = link == dof + 1 or link == dof + 2
        shift = -0.5 * width_m if link == dof + 1 else 0.5 * width_m
        first, last = robot.link_start[link], robot.link_start[link + 1]
        for k in range(first, last + 1):
            # After the link's own spheres, the one around them.
            point = robot.centers[k] if k < last else robot.link_spheres[link]
            row = k if k < last else n + link
            if finger:
                _tool0_from_finger(robot, width_m, point, shift, local)
            else:
                for i in range(3):
                    local[i] = point[i]
            for i in range(3):
                out[row, i] = T[i, 0] * local[0] + T[i, 1] * local[1] + T[i, 2] * local[2] + T[i, 3]


@njit(cache=True)
def scratch_for(robot):
    """Allocate memory for the checks: a configuration, all link poses, two poses, and the rows of place_spheres."""
    dof, rows = robot.axes.shape[0], robot.radii.shape[0] + robot.link_start.shape[0] - 1
    return np.empty(dof), np.empty((dof + 1, 3, 4)), np.empty((2, 3, 4)), np.empty((rows, 3))


@njit(cache=True)
def joint_reach(robot, width_m):
    """Return [joint, link]: the largest distance of a point of the link from the joint's axis; 0 if unmoved."""
    dof, links = robot.axes.shape[0], robot.link_start.shape[0] - 1
    reach = np.zeros((dof, links))
    local = np.empty(3)
    for link in range(links):
        extent = 0.0
        shift = -0.5 * width_m if link == dof + 1 else 0.5 * width_m
        for s in range(robot.link_start[link], robot.link_start[link + 1]):
            if link == dof + 1 or link == dof + 2:
                _tool0_from_finger(robot, width_m, robot.centers[s], shift, local)
            else:
                local[:] = robot.centers[s]
            extent = max(extent, np.sqrt(local[0] ** 2 + local[1] ** 2 + local[2] ** 2) + robot.radii[s])
        if link >= dof:
            extent += np.sqrt(robot.tool[0, 3] ** 2 + robot.tool[1, 3] ** 2 + robot.tool[2, 3] ** 2)
        for i in range(min(link, dof - 1), -1, -1):
            reach[i, link] = extent
            p = robot.parents[i]
            extent += np.sqrt(p[0, 3] ** 2 + p[1, 3] ** 2 + p[2, 3] ** 2)
    return reach
