"""The simulated PX4's parameters, by PX4's names, in its units and with the defaults of 1.17 in simulation."""

from __future__ import annotations

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Spec

_WHOLE = {
    "BAT1_N_CELLS": 4, "COM_ARM_WO_GPS": 1, "COM_DL_LOSS_T": 10, "COM_FLTMODE1": -1, "COM_FLTMODE2": -1,
    "COM_FLTMODE3": -1, "COM_FLTMODE4": -1, "COM_FLTMODE5": -1, "COM_FLTMODE6": -1, "COM_HOME_EN": 1,
    "COM_HOME_IN_AIR": 0, "COM_LOW_BAT_ACT": 0, "COM_OBL_RC_ACT": 0, "COM_POS_LOW_ACT": 3, "COM_PREARM_MODE": 0,
    "COM_QC_ACT": 0, "COM_RC_IN_MODE": 1, "COM_RC_OVERRIDE": 1, "COM_RCL_EXCEPT": 0, "COM_TAKEOFF_ACT": 0,
    "CP_GO_NO_DATA": 0, "EKF2_GPS_CTRL": 7, "EKF2_HGT_REF": 1, "GF_ACTION": 2, "GF_PREDICT": 0, "GF_SOURCE": 0,
    "MAV_COMP_ID": 1, "MAV_HASH_CHK_EN": 1, "MAV_PROTO_VER": 2, "MAV_SYS_ID": 1, "MAV_TYPE": 2,
    "MIS_LND_ABRT_ALT": 30, "MIS_TKO_LAND_REQ": 0, "MNT_MODE_IN": -1, "MPC_POS_MODE": 4, "MPC_USE_HTE": 1,
    "MPC_YAW_MODE": 0, "NAV_DLL_ACT": 0, "NAV_FORCE_VT": 1, "NAV_RCL_ACT": 2, "NAV_TRAFF_AVOID": 1,
    "RTL_CONE_ANG": 45, "RTL_PLD_MD": 0, "RTL_TYPE": 0, "SDLOG_MODE": 0, "SYS_AUTOCONFIG": 0, "SYS_AUTOSTART": 10040,
}  # fmt: skip
_FLOATS = {
    "BAT1_CAPACITY": 9000, "BAT_CRIT_THR": 0.07, "BAT_EMERGEN_THR": 0.05, "BAT_LOW_THR": 0.15, "COM_DISARM_LAND": 2,
    "COM_DISARM_PRFLT": 10, "COM_FAIL_ACT_T": 5, "COM_OF_LOSS_T": 1, "COM_RC_LOSS_T": 0.5, "COM_SPOOLUP_TIME": 1,
    "CP_DELAY": 0.4,
    "CP_DIST": -1, "CP_GUIDE_ANG": 30, "GF_MAX_HOR_DIST": 0, "GF_MAX_VER_DIST": 0, "LNDMC_TRIG_TIME": 1,
    "MIS_DIST_1WP": 10000, "MIS_TAKEOFF_ALT": 2.5, "MIS_YAW_ERR": 12, "MIS_YAW_TMT": -1, "MPC_ACC_DOWN_MAX": 3,
    "MPC_ACC_HOR": 3, "MPC_ACC_HOR_MAX": 5, "MPC_ACC_UP_MAX": 4, "MPC_JERK_AUTO": 4, "MPC_JERK_MAX": 8,
    "MPC_LAND_ALT1": 10, "MPC_LAND_ALT2": 5, "MPC_LAND_ALT3": 1, "MPC_LAND_CRWL": 0.3, "MPC_LAND_SPEED": 0.7,
    "MPC_THR_HOVER": 0.5, "MPC_TILTMAX_AIR": 45, "MPC_TILTMAX_LND": 12, "MPC_TKO_RAMP_T": 3, "MPC_TKO_SPEED": 1.5,
    "MPC_VEL_MANUAL": 10, "MPC_XY_CRUISE": 5, "MPC_XY_ERR_MAX": 2, "MPC_XY_P": 0.95, "MPC_XY_TRAJ_P": 0.5,
    "MPC_XY_VEL_ALL": -10, "MPC_XY_VEL_D_ACC": 0.2, "MPC_XY_VEL_I_ACC": 0.4, "MPC_XY_VEL_MAX": 12,
    "MPC_XY_VEL_P_ACC": 1.8, "MPC_YAWRAUTO_ACC": 20, "MPC_YAWRAUTO_MAX": 60, "MPC_Z_P": 1, "MPC_Z_VEL_ALL": -3,
    "MPC_Z_VEL_D_ACC": 0, "MPC_Z_VEL_I_ACC": 2, "MPC_Z_VEL_MAX_DN": 1.5, "MPC_Z_VEL_MAX_UP": 3, "MPC_Z_VEL_P_ACC": 4,
    "MPC_Z_V_AUTO_DN": 1.5, "MPC_Z_V_AUTO_UP": 3, "NAV_ACC_RAD": 2, "NAV_LOITER_RAD": 80, "NAV_MC_ALT_RAD": 0.8,
    "NAV_MIN_GND_DIST": -1, "NAV_MIN_LTR_ALT": -1, "RTL_DESCEND_ALT": 10, "RTL_LAND_DELAY": 0, "RTL_LOITER_RAD": 80,
    "RTL_MIN_DIST": 10, "RTL_RETURN_ALT": 30,
}  # fmt: skip
_RANGES = {
    "BAT1_CAPACITY": (-1, 1e6), "MPC_ACC_HOR": (2, 15), "MPC_JERK_AUTO": (1, 80), "MPC_XY_CRUISE": (3, 20),
    "MPC_XY_VEL_MAX": (0, 20), "MPC_Z_V_AUTO_UP": (0.5, 8), "MPC_Z_V_AUTO_DN": (0.5, 4), "NAV_ACC_RAD": (0.05, 200),
    "NAV_MC_ALT_RAD": (0.05, 200), "MPC_XY_ERR_MAX": (0.1, 10), "MPC_TKO_SPEED": (0.1, 5), "MPC_LAND_SPEED": (0.1, 5),
    "MAV_SYS_ID": (1, 250), "RTL_CONE_ANG": (0, 90), "COM_OF_LOSS_T": (0, 60), "COM_DISARM_LAND": (-1, 20),
}  # fmt: skip
_OWN = {"SIM_WIND_DIR": Spec("float", 180, 0, 360), "SIM_WIND_SPD": Spec("float", 0, 0, 40)}
"""The simulation's own, called as on the simulated ArduCopter."""


def _specs() -> dict[str, Spec]:
    found = dict(_OWN)
    for name, value in _WHOLE.items():
        found[name] = Spec("int32", value, *_RANGES.get(name, ()))
    for name, value in _FLOATS.items():
        found[name] = Spec("float", value, *_RANGES.get(name, ()))
    return dict(sorted(found.items()))


PX4_SPECS = _specs()
