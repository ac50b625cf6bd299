"""An xls workbook as a testing machine writes it: sheets of results with a mean, and of values; 7,000 N at 1.6 %."""

import base64
import zlib

XLS = zlib.decompress(
    base64.b85decode(
        "c-rk)O-NKx6h8O;%%7vq_(v*<NLiU1v4tBQE7XM~T7)G+&E!)Cou`a0tf(xLRzW{2rHwy}BCu>>MMXcWh`^{t6a-pr!c|nzLY>Y%"
        "?>?QG-a?@y<DKE2ckj99JNLYMzkA=C_iDyJJ35s&2T4)|GAza1;E1y^EN-*m1MH8*c-6eRu*7WHP~vvsLON7<kowZe*O0IG97u3m"
        "d5Rj~BbHX^frf5fD_lp}LpcN)&!Lhj$UO<JVM&8r$}5BPG18f&Z;|gq($!?SNV*bzXITr(1R6>z1dk6%Mbwvun!#PdyeCT;WW#gL"
        "<1?3-;j6;#XgJvQZ*~+YUYGz}xjIePqQS0N$igL@fFH3!fbZsBeNt%K*VoPf?LQOkP7C{0NdXvu*ipubID}M9S9p&HYN8!lNDue+"
        "YD16?^>hw9p)uMW(hAEKpb5O<G*-c|dc{=_MYV9BmI_c4)_Z$`y599!@6a%8Z6w%_9FIhhLk(E^Wq@X_0|V4YgYA7D9*~X$U&3*a"
        "N}I%sx(zeobw6ztA0GG%H@?2!7itU~A<F<g0*nX6R(@v?gR>lg;56z{mURgsc9K3vQS+&uM>-2{3$MkE*`iWANIvJOw;0DMCwUXt"
        "7FXYn^`ZHudj&(E0z0riSvPkgYw~Si6pC=F+7QowgHXy!*~l=L`vLRH#F6rWbnb7*i%ar}++*Ttm=25Jp{k#>(c-himRpjTE2AZ2"
        "OBS(MQY<Dp$mS<sMsXB@WE5wm#p9?Vj+7MV5fqTkPiyCg7o>}1u0s)?14qdgcOoyN9>FGTF-vrnlmXLx06b(@WIed!B`s}W?nsv0"
        "aVBub6~~Wce}f+@JYY#YkP>*1A$YK&+49=Qd!ClewIAmk#o0F2{%}Qh%j1K+)f}T(L{|v2mvKFrYDQO+Jb65oJa^Gde+w8EKEm~K"
        "J^#z*VH&|<k(I&VLCMI<5tr3CVVo8iCt*C|PMn09A89>xQoTtSmqmWAxcua5!@_Z6ITyB!J)0t&+XCk%Tt_<>N3~($xXbS{?}UTX"
        "g!5R;oQH6-YVImy=29#?Q^@lGd0t`MllC82?LS*=vBef!Y+1E1@k%9&*K$?7xH-jlokc85_Ggm+R`x?T{`&B5X$|Ojjl%IY@h1mV"
        "X2xQx#F*a;xisVGQRsva<<Yrj{^Cn6i@%>$1ATvP3$1nhrM2Ywm&gAFw3kAA"
    )
)
