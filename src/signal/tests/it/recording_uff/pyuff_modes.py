"""Writes the files of modes beside this script: a cantilever of 80 finite elements, exported by pyuff 2.5.8."""

import os

import numpy as np
import pyuff

# Euler cantilever, 423 x 50 x 5 mm steel, kt 1.4e6 N/m, kr 1200 N m/rad at x = 0; 80 Hermite elements.
L,b,h,E,rho=0.423,0.05,0.005,207e9,7850.0
kt,kr=1.4e6,1200.0
n=80; le=L/n; A=b*h; I=b*h**3/12
K=np.zeros((2*n+2,)*2); M=K.copy()
ke=E*I/le**3*np.array([[12,6*le,-12,6*le],[6*le,4*le**2,-6*le,2*le**2],[-12,-6*le,12,-6*le],[6*le,2*le**2,-6*le,4*le**2]])
me=rho*A*le/420*np.array([[156,22*le,54,-13*le],[22*le,4*le**2,13*le,-3*le**2],[54,13*le,156,-22*le],[-13*le,-3*le**2,-22*le,4*le**2]])
for e in range(n):
    s=slice(2*e,2*e+4); K[s,s]+=ke; M[s,s]+=me
K[0,0]+=kt; K[1,1]+=kr
w2,V=np.linalg.eig(np.linalg.solve(M,K)); o=np.argsort(w2.real); w=np.sqrt(w2.real[o]); V=V.real[:,o]
f=w/2/np.pi
x=np.linspace(0,L,n+1)
pts=np.array([0.033,0.083,0.133,0.183,0.233,0.283,0.333,0.383])
nodes=np.arange(1,9)
damp=[0.012,0.006,0.004,0.003,0.0025]
def write(name, complex_, geometry):
    if os.path.exists(name): os.remove(name)
    u=pyuff.UFF(name)
    sets=[{'type':164,'units_code':1,'units_description':'SI: Meter (newton)','temp_mode':2,'length':1.0,'force':1.0,'temp':1.0,'temp_offset':273.15}]
    if geometry==15:
        sets.append({'type':15,'node_nums':nodes,'def_cs':0*nodes,'disp_cs':0*nodes,'color':0*nodes,'x':pts,'y':0*pts,'z':0*pts+0.0025})
    else:
        sets.append({'type':2411,'node_nums':nodes,'def_cs':0*nodes,'disp_cs':0*nodes,'color':0*nodes,'x':pts,'y':0*pts,'z':0*pts+0.0025})
    for k in range(5):
        phi=np.interp(pts,x,V[0::2,k]); phi=phi/np.abs(phi).max()
        d={'type':55,'model_type':1,'id1':'cantilever, mode %d'%(k+1),'id2':'NONE','id3':'NONE','id4':'NONE','id5':'NONE',
           'data_ch':2,'spec_data_type':8,'load_case':1,'mode_n':k+1,'node_nums':nodes,'n_data_per_node':3}
        if complex_:
            z=damp[k]; s=w[k]*(-z+1j*np.sqrt(1-z*z)); rot=np.exp(0.7j)
            d.update(analysis_type=3,data_type=5,eig=s,modal_a=1+0j,modal_b=0j,r1=0*phi*rot,r2=0*phi*rot,r3=phi*rot)
        else:
            d.update(analysis_type=2,data_type=2,freq=f[k],modal_m=0,modal_damp_vis=damp[k],modal_damp_his=0,r1=0*phi,r2=0*phi,r3=phi)
        sets.append(d)
    u.write_sets(sets,'add')
write('pyuff-normal.unv',False,15)
write('pyuff-complex.unv',True,2411)
